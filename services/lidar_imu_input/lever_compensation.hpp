// The IMU's samples as if it sat at the vehicle's origin and were aligned with it.
#pragma once

#include <deque>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Turns samples into frame `vehicle` and takes out the force that the IMU feels because the
/// vehicle rotates about its origin: w x (w x l) + dw/dt x l, with lever l. Invariant: the kept
/// samples span at most about `kLeverBaseline_s`.
class LeverCompensation {
 public:
  /// `imu`: mount (vehicle_T_sensor) and `max_gap_s`.
  explicit LeverCompensation(const ImuParameters& imu) : imu_(imu) {}

  /// The sample in frame vehicle, as if measured at its origin. Precondition: stamps advance.
  model::ImuSample to_vehicle(const model::ImuSample& sensor_sample);

  /// Latest sample in frame vehicle, lever force not taken out. Precondition: to_vehicle() was
  /// called.
  const model::ImuSample& latest_raw() const { return raw_.back(); }
  /// Whether no sample has come yet.
  bool empty() const { return raw_.empty(); }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.raw_);
  }

 private:
  ImuParameters imu_;
  std::deque<model::ImuSample> raw_;  ///< Latest, frame vehicle, lever force not taken out.
};

}  // namespace understory::lidar_imu_input
