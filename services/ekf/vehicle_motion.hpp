// The filter's prediction by odometry, and the level reported by the latest odometry.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/reckoned_track.hpp"

namespace understory::ekf {

/// Owner of the distance driven and of the level's error reported by the latest odometry.
class VehicleMotion {
 public:
  explicit VehicleMotion(const EkfMotionParameters& parameters) : parameters_(parameters) {}

  /// Predicts `state` to the end of `increment`: by IMU, by wheels, or by both. O(size^2).
  void predict(const model::Odometry& increment, bool is_stationary, FilterState& state,
               LowRank& low_rank);
  /// Predicts `state` over `duration_s` without odometry, and adds the distance.
  void bridge(double duration_s, FilterState& state, LowRank& low_rank);
  /// Likewise with the motion by dead reckoning.
  void bridge(const ReckonedMotion& motion, double duration_s, FilterState& state,
              LowRank& low_rank);
  /// Likewise without distance: a stationary vehicle may have moved undetected for this time.
  void loosen(double duration_s, FilterState& state, LowRank& low_rank) const;
  /// The next odometry with an IMU sets the level's first uncertainty (after a restart).
  void forget_level();

  /// Distance driven [m].
  double distance_m() const { return distance_m_; }
  /// Covariance of the level's error (roll, pitch) [rad^2] as contained in the detections'
  /// covariances; none before odometry with an IMU.
  const std::optional<Eigen::Matrix2d>& level_covariance() const { return level_covariance_; }
  /// Tangent of the vehicle's pitch: a roll error changes the heading by this factor times the
  /// error.
  double pitch_tangent() const { return pitch_tangent_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.distance_m_, self.level_covariance_, self.pitch_tangent_);
  }

 private:
  void take_level(const model::LevelError& level, FilterState& state);

  EkfMotionParameters parameters_;
  double distance_m_ = 0.0;
  std::optional<Eigen::Matrix2d> level_covariance_;
  double pitch_tangent_ = 0.0;
};

}  // namespace understory::ekf
