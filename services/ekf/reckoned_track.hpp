// Where dead reckoning was: what it says of an interval of which the filter heard nothing.
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

/// The latest RAW_POSE. Dead reckoning goes on while the filter hangs; its last pose before a gap
/// and its first one after it tell the motion between. No landmark is in it: what the filter taught
/// it is its velocity of before the gap.
class ReckonedTrack {
 public:
  /// What is not finite, late, or aided by GNSS is left out; a clock that jumped back begins anew.
  void add(const model::RawPose& pose);

  /// The motion from one stamp to another, both within 150 ms of poses. None where poses are
  /// missing, and where they do not know the motion themselves: dead reckoning began anew, or had
  /// a gap of its own and states more than 0.15 rad.
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
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< Of what lies beyond the poses.
  };
  std::optional<Reached> at(model::Utime utime) const;

  std::deque<Pose> poses_;
};

}  // namespace understory::ekf
