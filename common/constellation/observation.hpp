// One observation, prepared for the search: its triangles, and the variance of each point.
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
      0.0;  ///< [m^2] Per axis, of the difference point - landmark: sum of both variances.
};

/// The usable points of an observation and their density.
struct PreparedObservation {
  std::vector<PreparedPoint> points;
  std::vector<std::uint32_t> observed;               ///< Index in the observation as given.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< [m] Mean of the points, frame `sensor`.
  double radius_m = 0.0;        ///< Radius of a disc with the same second moment.
  double density_per_m2 = 0.0;  ///< Points in that disc.
};

/// Computes centre, radius and density from the points.
void measure_extent(PreparedObservation& prepared);

/// Leaves out points that are not finite. A point's variance is the sum of its own variance and the
/// map's (LocaliseParameters::map_sigma_m); its own is at least the map's.
PreparedObservation prepare(std::span<const ObservedPoint> points,
                            const LocaliseParameters& parameters);

/// The points that stand at least `apart_m` from all others, ascending. O(n log n) as a rule.
std::vector<std::uint32_t> points_apart(const PreparedObservation& observation, double apart_m);

/// Triangles of an observation's points, made for a few points at a time: usually the first points
/// are enough to find the place, and the triangles of the others are never made.
class TriangleSource {
 public:
  /// Triangles are made among each point's `neighbours` nearest ones, and only among `members`
  /// (indices of prepared points). The observation must outlive the source.
  TriangleSource(const PreparedObservation& observation, std::span<const std::uint32_t> members,
                 int neighbours);

  /// True when every point's triangles were taken.
  bool exhausted() const { return next_ == order_.size(); }
  /// The triangles of the next `count` points, each triangle once in the life of the source;
  /// vertices are indices of prepared points. Triangles so flat that noise could mirror them are
  /// left out.
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
  std::vector<std::uint32_t> order_;  // indices into by_x_, in an order that spreads over the scene
  std::vector<Neighbours> neighbours_;  // by prepared point; empty until take()
  std::size_t next_ = 0;
};

}  // namespace understory::constellation
