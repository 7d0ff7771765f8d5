// One observation, prepared for the search: its triangles, and how well each point is known.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/constellation/localisation.hpp"
#include "common/constellation/triangles.hpp"

namespace understory::constellation {

/// A usable observed point, frame `sensor`.
struct PreparedPoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< [m]
  double variance =
      0.0;  ///< [m^2] Per axis, of the difference to its landmark: both sides' together.
};

/// The usable points of an observation and how densely they lie.
struct PreparedObservation {
  std::vector<PreparedPoint> points;
  std::vector<std::uint32_t> observed;               ///< Index in the observation as given.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< [m] Mean of the points, frame `sensor`.
  double radius_m = 0.0;                             ///< Of a disc with the same second moment.
  double density_per_m2 = 0.0;                       ///< Points in that disc.
};

/// Sets centre, radius and density by the points.
void measure_extent(PreparedObservation& prepared);

/// Leaves out points that are not finite. A point's variance is the sum of its own and the map's
/// (LocaliseParameters::map_sigma_m), the former not below the latter.
PreparedObservation prepare(std::span<const ObservedPoint> points,
                            const LocaliseParameters& parameters);

/// The points that stand at least `apart_m` from all others, ascending. O(n log n) as a rule.
std::vector<std::uint32_t> points_apart(const PreparedObservation& observation, double apart_m);

/// Triangles of an observation's points, made a few points at a time: as a rule the first few
/// points are enough to find the place, and the others' triangles are never made.
class TriangleSource {
 public:
  /// Triangles are made among each point's `neighbours` nearest ones, of `members` (indices of
  /// prepared points) only. The observation must outlive the source.
  TriangleSource(const PreparedObservation& observation, std::span<const std::uint32_t> members,
                 int neighbours);

  /// True when every point's triangles were taken.
  bool exhausted() const { return next_ == order_.size(); }
  /// The triangles of the next `count` points, each triangle once in the life of the source;
  /// vertices are indices of prepared points. Those so flat that noise could mirror them are left
  /// out.
  std::vector<Triangle> take(std::size_t count);

 private:
  static constexpr int kMaxNeighbours = 8;
  struct ByX {
    double x;
    double y;
    std::uint32_t point;
  };
  struct Neighbours {
    std::array<std::uint32_t, kMaxNeighbours> point{};
    int count = 0;
    bool has(std::uint32_t wanted) const;
  };
  Neighbours nearest(std::size_t place) const;

  const PreparedObservation& observation_;
  int wanted_;
  std::vector<ByX> by_x_;
  std::vector<std::uint32_t> order_;    // places in by_x_, spread over the scene
  std::vector<Neighbours> neighbours_;  // by prepared point; empty until it is taken
  std::size_t next_ = 0;
};

}  // namespace understory::constellation
