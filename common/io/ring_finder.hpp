// Finds the beam of each point in a cloud without rings.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace understory::io {

/// The turn of the azimuth of each point, 0 = the first, in a file with ring after ring (KITTI);
/// empty where the azimuth has no constant direction. A turn begins at `begin_rad`.
struct RingTurns {
  std::vector<std::uint32_t> turn;
  std::size_t turns = 0;
};
RingTurns find_turns(std::span<const Eigen::Vector3f> points_m, double begin_rad);

/// Rings found from points alone.
struct FoundRings {
  std::vector<std::uint16_t> ring;  ///< Ring of each point, 0 = the lowest; empty = none found.
  std::uint16_t rings = 0;
  std::string_view from;  ///< "the order of the points" or "elevations".
};

/// Finds the beams of a laser that scans in space from the points of one revolution in frame
/// `sensor` [m]: from their order, if ring follows ring (KITTI), else from their elevations, if
/// these are separated. Points that were de-skewed or merged from several revolutions have neither.
/// O(n log n).
FoundRings find_rings(std::span<const Eigen::Vector3f> points_m);

}  // namespace understory::io
