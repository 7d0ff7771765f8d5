// VELOCITY_CORRECTION messages until they take effect.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"

namespace understory::lidar_imu_input {

/// A correction stamped t takes effect at the first IMU sample not before t + delay, live and in
/// replay alike, so that both give the same output.
class VelocityCorrections {
 public:
  /// `delay_s`: `OutputParameters::correction_delay_s`.
  explicit VelocityCorrections(double delay_s)
      : delay_us_(static_cast<model::Utime>(delay_s * 1e6)) {}

  /// `latest`: stamp of the latest IMU sample. False: the correction came too late to take effect
  /// in time; it does so at the next sample.
  bool add(const model::VelocityCorrection& correction, std::optional<model::Utime> latest);
  /// The next one that is due at `now`, in order of arrival; none where there is none.
  std::optional<model::VelocityCorrection> take_due(model::Utime now);

  /// A correction was applied at `now`.
  void set_applied(model::Utime now) { applied_utime_ = now; }
  /// When one was last applied; 0 = never.
  model::Utime applied_utime() const { return applied_utime_; }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.applied_utime_);
  }

 private:
  model::Utime delay_us_;
  std::deque<model::VelocityCorrection> waiting_;
  model::Utime applied_utime_ = 0;
};

}  // namespace understory::lidar_imu_input
