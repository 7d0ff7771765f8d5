// Dead reckoning's motion over intervals without input to the filter.
#pragma once

#include <deque>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"

namespace understory::ekf {

/// A motion that was not followed step by step.
struct ReckonedMotion {
  geometry::SE2WithCovariance from_T_to;                   ///< Right perturbation.
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< At its end, axes of the vehicle.
};

/// The latest RAW_POSE. Dead reckoning continues while the filter hangs; its last pose before a gap
/// and its first one after it give the motion between. It contains no landmarks: the filter
/// affected only its velocity before the gap.
class ReckonedTrack {
 public:
  /// Adds a pose. Skipped: poses that are not finite, late, or aided by GNSS; a clock that jumped
  /// back begins a new track.
  void add(const model::RawPose& pose);

  /// The motion between two stamps, both within 150 ms of poses. None without poses, or if the
  /// poses do not cover the motion: dead reckoning restarted, or had a gap of its own and states
  /// more than 0.15 rad.
  std::optional<ReckonedMotion> between(model::Utime from, model::Utime to) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_);
  }

 private:
  struct Pose {
    model::Utime utime = 0;
    geometry::SE2 odom_T_vehicle;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.utime, s.odom_T_vehicle, s.covariance);
    }
  };
  struct Reached {
    geometry::SE2WithCovariance odom_T_vehicle;
    Eigen::Vector3d twist_per_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< Of the extrapolation beyond the poses.
  };
  std::optional<Reached> at(model::Utime utime) const;

  std::deque<Pose> poses_;
};

}  // namespace understory::ekf
