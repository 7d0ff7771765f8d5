// VELOCITY_CORRECTION messages that wait to be applied.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"

namespace understory::lidar_imu_input {

/// A correction stamped t is applied at the first IMU sample not before t + delay, live and in
/// replay alike, so that both give the same output.
class VelocityCorrections {
 public:
  /// `delay_s`: `OutputParameters::correction_delay_s`.
  explicit VelocityCorrections(double delay_s)
      : delay_us_(static_cast<model::Utime>(delay_s * 1e6)) {}

  /// `latest`: stamp of the latest IMU sample. False: the correction is late and is applied at the
  /// next sample.
  bool add(const model::VelocityCorrection& correction, std::optional<model::Utime> latest);
  /// The next one that is due at `now`, in order of arrival; none if none is due.
  std::optional<model::VelocityCorrection> take_due(model::Utime now);

  /// A correction was applied at `now`: it changed the velocity by `odom_change_mps` [m/s, frame
  /// `odom`].
  void set_applied(model::Utime now, const Eigen::Vector2d& odom_change_mps);
  /// Sum of the corrections applied after `utime`, which the velocity of that time does not
  /// contain. A late correction changes only the remaining error: all corrections of one burst
  /// contain the same error.
  Eigen::Vector2d change_since(model::Utime utime) const;
  /// Time of the last applied one; 0 = none.
  model::Utime applied_utime() const { return applied_utime_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.applied_utime_, self.changes_);
  }

 private:
  struct Change {
    model::Utime utime = 0;
    Eigen::Vector2d odom_mps = Eigen::Vector2d::Zero();

    /// For saving and loading.
    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.utime, self.odom_mps);
    }
  };

  model::Utime delay_us_;
  std::deque<model::VelocityCorrection> waiting_;
  model::Utime applied_utime_ = 0;
  std::deque<Change> changes_;  ///< As far back as velocities are known.
};

}  // namespace understory::lidar_imu_input
