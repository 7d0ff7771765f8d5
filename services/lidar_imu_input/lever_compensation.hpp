// Transforms the IMU's samples to the vehicle's origin and axes.
#pragma once

#include <deque>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Rotates samples into frame `vehicle` and subtracts the force that the IMU measures because the
/// vehicle rotates about its origin: w x (w x l) + dw/dt x l, with lever l. Invariant: the stored
/// samples span at most about `kLeverBaseline_s`.
class LeverCompensation {
 public:
  /// `imu`: mount (vehicle_T_sensor) and `max_gap_s`.
  explicit LeverCompensation(const ImuParameters& imu) : imu_(imu) {}

  /// The sample in frame vehicle, as if measured at its origin. Precondition: stamps advance.
  model::ImuSample to_vehicle(const model::ImuSample& sensor_sample);

  /// Latest sample in frame vehicle, with the lever force. Precondition: to_vehicle() was called.
  const model::ImuSample& latest_raw() const { return raw_.back(); }
  /// Whether no sample has arrived yet.
  bool empty() const { return raw_.empty(); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.raw_);
  }

 private:
  ImuParameters imu_;
  std::deque<model::ImuSample> raw_;  ///< Latest, frame vehicle, with the lever force.
};

}  // namespace understory::lidar_imu_input
