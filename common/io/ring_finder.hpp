// Which beam saw a point, where the cloud does not say so.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace understory::io {

/// The turn of the azimuth that each point belongs to, 0 = the first, where a file has ring after
/// ring (KITTI); empty where the azimuth goes in no one sense. A turn begins at `begin_rad`.
struct RingTurns {
  std::vector<std::uint32_t> turn;
  std::size_t turns = 0;
};
RingTurns find_turns(std::span<const Eigen::Vector3f> points_m, double begin_rad);

/// Rings found from points alone.
struct FoundRings {
  std::vector<std::uint16_t> ring;  ///< Of each point, 0 = the lowest; empty = none were found.
  std::uint16_t rings = 0;
  std::string_view from;  ///< "the order of the points" or "elevations".
};

/// Finds the beams of a laser that scans in space from the points of one revolution in frame
/// `sensor` [m]: from their order, where each ring lies whole behind the other (KITTI), else from
/// their elevations, where these stand apart. Points that were de-skewed or put together from
/// several revolutions have neither. n log n in the number of points.
FoundRings find_rings(std::span<const Eigen::Vector3f> points_m);

}  // namespace understory::io
