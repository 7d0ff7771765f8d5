// Upright walls: straight segments of several rings, one above the other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_runs.hpp"

namespace understory::landmark_extractor::corners {

/// Area spanned by two vectors of the plan, positive if b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Sums over points of the plan, relative to an anchor, for fitting a line.
struct LineSums {
  double count = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();  ///< [m]
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();

  /// Adds one point.
  void add(const Eigen::Vector2d& point);
  /// Adds the points of another sum with the same anchor.
  LineSums& operator+=(const LineSums& other);
};

/// A straight segment of one ring, frame `vehicle_level`.
struct LineSegment {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();  ///< Right end as seen from the sensor.
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();    ///< Left end.
  LineSums sums;
  std::uint32_t first_part =
      0;  ///< Index of its first part (some neighbours each) among those of the sweep.
  std::uint32_t parts = 0;
  std::uint16_t ring = 0;
  double z_m = 0.0;         ///< Mean.
  std::uint32_t first = 0;  ///< Indices of its end points in the cloud.
  std::uint32_t last = 0;
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< Unit, from end to end.
  double length_m = 0.0;
};

/// The measured extent of a vertical plane; frame `vehicle_level`.
struct WallLine {
  Eigen::Vector2d centroid_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction =
      Eigen::Vector2d::UnitX();      ///< Unit; to the left as seen from the sensor.
  double from_m = 0.0;               ///< Extent along `direction`, from the centroid.
  double to_m = 0.0;                 ///< Other end of the extent.
  double z_m = 0.0;                  ///< Mean of its points.
  double unevenness_m = 0.0;         ///< RMS deviation from a plane beyond the points' noise.
  double offset_sigma_m = 0.0;       ///< Of the centroid, across the wall.
  double direction_sigma_rad = 0.0;  ///< Of `direction`.
  double low_z_m = 0.0;              ///< Of the lowest ring.
  double high_z_m = 0.0;             ///< Of the highest ring.
  int rings = 0;                     ///< Number of rings that measured it.

  /// Extent along `direction` [m].
  double length() const { return to_m - from_m; }
  /// Unit, left of `direction`.
  Eigen::Vector2d normal() const { return {-direction.y(), direction.x()}; }
};

/// The points of the runs, and the sensor's position at utime; frame `vehicle_level`.
struct WallPoints {
  std::span<const points::RingPoint> points;
  std::size_t rings = 0;
  Eigen::Vector2d sensor_m = Eigen::Vector2d::Zero();
};

/// Cuts runs into straight segments (Douglas and Peucker), joins segments of neighbouring rings in
/// one upright plane (for a laser with one ring: in one line), and fits a line to each group.
/// Reuses memory between sweeps, but has no state.
class WallFinder {
 public:
  /// Noise and limits are taken from the parameters.
  WallFinder(const SweepParameters& sweep, const CornerParameters& corner)
      : sweep_(sweep), corner_(corner) {}

  /// The walls of one sweep; they are valid until the next call.
  const std::vector<WallLine>& find(const WallPoints& all, const std::vector<rings::Run>& runs);

 private:
  void split(const WallPoints& all, const rings::Run& run, std::size_t first, std::size_t last);
  void add_segment(const WallPoints& all, const rings::Run& run, std::size_t first,
                   std::size_t last);
  void join();
  bool same_wall(const LineSegment& a, const LineSegment& b) const;
  /// Variance across the wall, of each point [m^2]; `axis2_m2` is their mean square deviation from
  /// the line.
  double variance_across(const LineSums& sums, const WallLine& wall, double axis2_m2) const;
  std::uint32_t root(std::uint32_t segment);
  void add_wall(const std::vector<std::uint32_t>& members);
  double unevenness(const std::vector<std::uint32_t>& members, const WallLine& wall,
                    double variance_m2) const;

  /// Some neighbours on a segment.
  struct SegmentPart {
    double count = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  };

  SweepParameters sweep_;
  CornerParameters corner_;
  Eigen::Vector2d sensor_m_ = Eigen::Vector2d::Zero();
  bool is_one_ring_ = false;
  std::vector<LineSegment> segments_;
  std::vector<SegmentPart> parts_;
  std::vector<std::size_t> ring_begins_;             ///< Among the segments.
  std::vector<std::uint32_t> parents_;               ///< Of each segment: a disjoint-set forest.
  std::vector<std::vector<std::uint32_t>> members_;  ///< Segments by root.
  std::vector<WallLine> walls_;
};

}  // namespace understory::landmark_extractor::corners
