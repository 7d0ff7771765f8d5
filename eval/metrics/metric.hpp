// How well a map agrees with the truth: RPE, ROE and LPE as in GeoSLAM §4.5.8, and what they hide.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "sim/drive.hpp"

namespace understory::eval::metrics {

/// An estimated pose and the scan that it belongs to.
struct PoseEstimate {
  std::size_t scan = 0;  ///< Index of the scan whose pose this is.
  /// True pose of the vehicle at a scan.
  geometry::SE2 map_T_vehicle;
};

/// A map after one update.
struct MapState {
  std::vector<PoseEstimate> poses;
  std::vector<Eigen::Vector2d> landmarks_m;
};

/// The truth of a drive in the frame of the map: that of the vehicle at scan `base`, the base of
/// the first accepted keyframe. Nothing is aligned.
class MapTruth {
 public:
  /// The truth of a simulated drive.
  MapTruth(const sim::Drive& drive, std::size_t base);
  /// Poses of any vehicle among any trunks; `in_range` (ascending) are those that were in its
  /// range.
  MapTruth(std::vector<geometry::SE2> world_T_vehicle, std::size_t base,
           std::vector<Eigen::Vector2d> trunks_m, std::vector<std::uint32_t> in_range);

  /// True pose of the vehicle at a scan, frame `map`.
  geometry::SE2 map_T_vehicle(std::size_t scan) const {
    return map_T_world_ * world_T_vehicle_[scan];
  }
  /// The true trunk nearest to a point of the map. Of all trunks: one just out of range is
  /// detected when noise brings it in, and is no false landmark.
  sim::PointGrid::Neighbour nearest_trunk(const Eigen::Vector2d& point_in_map_m) const;
  /// True trunks within `radius_m` of a point of the map.
  std::vector<std::uint32_t> trunks_within(const Eigen::Vector2d& point_in_map_m,
                                           double radius_m) const;
  /// True position of a trunk, frame `map`.
  Eigen::Vector2d trunk_m(std::uint32_t trunk) const { return map_T_world_ * trunks_m_[trunk]; }
  /// Trunks that were ever in range, ascending.
  std::span<const std::uint32_t> trunks_in_range() const { return in_range_; }

 private:
  geometry::SE2 map_T_world_;
  std::vector<geometry::SE2> world_T_vehicle_;
  std::vector<Eigen::Vector2d> trunks_m_;
  std::vector<std::uint32_t> in_range_;
  sim::PointGrid grid_;  ///< Of all trunks, frame world.
};

/// Sums of errors over poses or landmarks, over states.
struct ErrorSums {
  double position_m = 0.0;
  double heading_rad = 0.0;
  std::size_t poses = 0;
  double landmark_m = 0.0;
  std::size_t landmarks = 0;

  ErrorSums& operator+=(const ErrorSums& other);
  double rpe_m() const;    ///< Mean over all poses of all states; 0 if none.
  double roe_rad() const;  ///< The same for |heading error|.
  double lpe_m() const;    ///< Mean distance to the nearest true trunk.
};

/// The sums of one state. A run's RPE is `rpe_m()` of the sum over its states, so that late states
/// count for more (as in GeoSLAM's code).
ErrorSums errors_of(const MapState& state, const MapTruth& truth);

/// Absolute trajectory error [m]: RMSE of the positions after the best rigid alignment; 0 of fewer
/// than three poses.
double absolute_trajectory_error(std::span<const PoseEstimate> poses, const MapTruth& truth);

/// How many trunks the map has, and how many landmarks are none.
struct MapCompleteness {
  std::size_t well_seen = 0;      ///< Trunks detected in at least `min_observation_count` scans.
  std::size_t recalled = 0;       ///< Of those, the ones that have a landmark of their own.
  std::size_t landmarks = 0;      ///< In the map.
  std::size_t without_trunk = 0;  ///< Landmarks paired with no trunk: false or double.
};
/// Landmarks and trunks are paired one to one, nearest pairs first, up to 1 m apart.
MapCompleteness map_completeness(std::span<const Eigen::Vector2d> landmarks_m,
                                 const MapTruth& truth,
                                 std::span<const std::uint32_t> observation_count_of_trunk,
                                 std::uint32_t min_observation_count = 20);

}  // namespace understory::eval::metrics
