// The filter's prediction by odometry, and what the latest odometry reports about the level.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/reckoned_track.hpp"

namespace understory::ekf {

/// Owner of the distance driven and of the level's error as the latest odometry reports it.
class VehicleMotion {
 public:
  explicit VehicleMotion(const EkfMotionParameters& parameters) : parameters_(parameters) {}

  /// Predicts `state` to the end of `increment`: by IMU, by wheels, or by both. O(size^2).
  void predict(const model::Odometry& increment, bool is_stationary, FilterState& state,
               LowRank& low_rank);
  /// Predicts `state` over `duration_s` without odometry, and counts the distance.
  void bridge(double duration_s, FilterState& state, LowRank& low_rank);
  /// The same where dead reckoning knows the motion.
  void bridge(const ReckonedMotion& motion, double duration_s, FilterState& state,
              LowRank& low_rank);
  /// The same without distance: a stationary vehicle may have moved unnoticed for so long.
  void loosen(double duration_s, FilterState& state, LowRank& low_rank) const;
  /// The next odometry with an IMU sets the level's first uncertainty (after a restart).
  void forget_level();

  /// Distance driven [m].
  double distance_m() const { return distance_m_; }
  /// Covariance of the level's error (roll, pitch) [rad^2] as detections have it in theirs; none
  /// before odometry with an IMU was used.
  const std::optional<Eigen::Matrix2d>& level_covariance() const { return level_covariance_; }
  /// Tangent of the vehicle's pitch: a wrong roll changes the heading by so much of it.
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
