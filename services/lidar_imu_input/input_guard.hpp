// Checks of the sensors' stamps and samples, before their use.
#pragma once

#include <optional>
#include <vector>

#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/input_fault.hpp"
#include "services/lidar_imu_input/sensor_clock.hpp"

namespace understory::lidar_imu_input {

/// All sensors' clocks, silence, and frozen or saturated samples. Faults are reported once per
/// episode (saturation and refusals: each time; the receiver limits the rate).
class InputGuard {
 public:
  /// `imu`: ranges, at which a sample is saturated. `expected`: sensors that must send.
  InputGuard(const FaultParameters& parameters, const ImuParameters& imu,
             const ExpectedSensors& expected = {});

  /// The stamp to use, in the stage's time; none if the sample is to be dropped.
  std::optional<model::Utime> admit(Sensor sensor, model::Utime raw,
                                    std::vector<InputFault>& faults);
  /// Whether the sample has been the same for too long: then do not use it.
  bool is_frozen(const model::ImuSample& sample, std::vector<InputFault>& faults);
  /// Whether the laser repeated the points of the previous revolution.
  bool is_frozen(const model::PointSweep& sweep, std::vector<InputFault>& faults);
  /// Whether a rate or a force is at the end of the sensor's range: then it is a bound, not a
  /// measurement.
  bool is_saturated(const model::ImuSample& sample, std::vector<InputFault>& faults) const;
  /// Reports sensors that have become silent by `now()`.
  void find_silent(std::vector<InputFault>& faults);

  /// Newest stamp of all sensors but GNSS, whose receivers start with wrong dates; none before the
  /// first one.
  std::optional<model::Utime> now() const;
  /// After silence of all sensors: they continue at `utime`, as if last received then.
  void go_on_at(model::Utime utime) { resumed_ = utime; }
  /// Newest stamp of one sensor.
  std::optional<model::Utime> last(Sensor sensor) const { return state(sensor).clock.last(); }
  /// The sensor must send and does not: it became silent, or was expected and never sent.
  bool is_silent(Sensor sensor) const;
  /// The sensor has sent, and has not become silent.
  bool is_live(Sensor sensor) const;
  /// Whether no more data of IMU and wheels is expected for the time up to `utime`: both have
  /// reached it or are silent, or it is more than `max_wait_s` ago.
  bool has_motion_until(model::Utime utime, double max_wait_s) const;
  /// Whether the sensor has sent anything yet.
  bool has_spoken(Sensor sensor) const { return state(sensor).clock.last().has_value(); }
  /// Conversion of a sensor's stamp to the stage's time, as far as known.
  model::Utime on_stage_time(Sensor sensor, model::Utime raw) const {
    return raw + state(sensor).clock.offset_us();
  }
  /// Mean time between two samples of a sensor [us]; 0 = unknown.
  double period_us(Sensor sensor) const { return state(sensor).clock.period_us(); }
  /// A longer step than this [s] is a pause or a jump of the sensor's clock.
  double longest_step_s(Sensor sensor) const { return state(sensor).clock.longest_step_s(); }
  /// Present time: now(), or the time of the restart after a pause until a reading is used. None
  /// before the start.
  std::optional<model::Utime> time() const { return newest_but(Sensor::kGnss); }
  /// Whether a stamp in the stage's time is not far ahead of all others.
  bool is_believable(model::Utime utime) const;
  /// Whether a sensor other than this one and GNSS is not silent.
  bool has_others(Sensor sensor) const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    for (auto& state : self.states_) a(state.clock, state.is_silent);
    a(self.same_since_, self.is_frozen_, self.first_points_, self.first_, self.resumed_);
  }

 private:
  struct State {
    SensorClock clock;
    bool is_silent = false;
  };
  const State& state(Sensor sensor) const { return states_[static_cast<std::size_t>(sensor)]; }
  State& state(Sensor sensor) { return states_[static_cast<std::size_t>(sensor)]; }
  double silent_s(Sensor sensor) const;
  bool is_expected(Sensor sensor) const;
  std::optional<model::Utime> newest_but(Sensor sensor) const;
  void share_jump(Sensor sensor, model::Utime raw, std::optional<model::Utime> before);

  FaultParameters parameters_;
  ImuParameters imu_;
  ExpectedSensors expected_;
  std::vector<State> states_;
  std::optional<model::ImuSample> same_since_;   ///< The first of the equal samples.
  bool is_frozen_ = false;                       ///< The IMU: already reported.
  std::vector<model::SweepPoint> first_points_;  ///< Of the latest sweep.
  std::optional<model::Utime> first_;            ///< Stamp of the first reading.
  std::optional<model::Utime> resumed_;          ///< Restart time after the latest pause.
};

}  // namespace understory::lidar_imu_input
