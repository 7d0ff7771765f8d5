// What is wrong with a sensor's stamps and samples, before anybody believes them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

enum class InputFaultKind : std::uint8_t {
  kNotFinite,      ///< NaN or infinite: dropped.
  kLate,           ///< Not after its predecessor: dropped.
  kClockJump,      ///< The sensor's clock jumped: quarantined, then followed.
  kSilent,         ///< Nothing came for too long.
  kFrozen,         ///< The very same again and again.
  kSaturated,      ///< At the end of its range: left out.
  kNoPointTimes,   ///< A sweep whose points have no times.
  kNoMotion,       ///< A sweep that could not wait for motion any longer: not de-skewed.
  kNotCalibrated,  ///< The vehicle moved before it had stood still long enough.
};

struct InputFault {
  InputFaultKind kind = InputFaultKind::kLate;
  std::string channel;
  std::string text;
};

enum class Sensor : std::uint8_t { kImu, kWheels, kGnss, kSweep, kScan };
constexpr std::size_t kSensors = 5;
/// RAW_IMU and so on.
std::string channel_of(Sensor sensor);

/// One sensor's clock. A jump (back, or ahead of all others) is not believed until some samples
/// agree with each other; from then on their stamps are moved so that time goes on.
class SensorClock {
 public:
  enum class Verdict : std::uint8_t { kFine, kLate, kJumped, kQuarantined, kFollowed };
  struct Answer {
    Verdict verdict = Verdict::kFine;
    model::Utime utime = 0;  ///< Of the sample, on the stage's time; for kFine and kFollowed.
  };

  explicit SensorClock(const FaultParameters& parameters) : parameters_(parameters) {}
  /// `others`: the newest stamp of the other sensors, if there is any.
  Answer take(model::Utime raw, std::optional<model::Utime> others);
  std::optional<model::Utime> last() const { return last_; }
  model::Utime offset_us() const { return offset_; }
  /// The service was away: the next stamp may be far ahead of the last one.
  void resume() { is_resumed_ = true; }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.last_, self.period_us_, self.offset_, self.first_candidate_, self.candidate_,
      self.agreeing_);
  }

 private:
  Answer quarantine(model::Utime raw);
  bool is_plausible(model::Utime utime, std::optional<model::Utime> others) const;

  FaultParameters parameters_;
  std::optional<model::Utime> last_;
  double period_us_ = 0.0;
  model::Utime offset_ = 0;
  std::optional<model::Utime> first_candidate_;
  model::Utime candidate_ = 0;
  int agreeing_ = 0;
  bool is_resumed_ = false;
};

/// All sensors' clocks, silence, and frozen or saturated samples. Faults are said once per episode
/// (saturation and refusals: each time; whoever reports limits the rate).
class InputGuard {
 public:
  InputGuard(const FaultParameters& parameters, const ImuParameters& imu);

  /// The stamp to use, or none where the sample is to be dropped.
  std::optional<model::Utime> admit(Sensor sensor, model::Utime raw,
                                    std::vector<InputFault>& faults);
  /// Whether the sample is the same for too long: not to be used.
  bool is_frozen(const model::ImuSample& sample, std::vector<InputFault>& faults);
  bool is_saturated(const model::ImuSample& sample, std::vector<InputFault>& faults) const;
  /// Looks for sensors that have gone silent by `now()`.
  void find_silent(std::vector<InputFault>& faults);

  /// Newest stamp of all sensors.
  std::optional<model::Utime> now() const;
  std::optional<model::Utime> last(Sensor sensor) const { return state(sensor).clock.last(); }
  /// It has spoken, and not gone silent.
  bool is_live(Sensor sensor) const;
  bool has_spoken(Sensor sensor) const { return state(sensor).clock.last().has_value(); }
  /// What a sensor's stamp is on the stage's time, as far as is known.
  model::Utime on_stage_time(Sensor sensor, model::Utime raw) const {
    return raw + state(sensor).clock.offset_us();
  }

  /// The service was away: no sensor's silence meanwhile is a jump of its clock.
  void resume() {
    for (State& state : states_) state.clock.resume();
  }
  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    for (auto& state : self.states_) a(state.clock, state.is_silent);
    a(self.same_since_, self.is_frozen_);
  }

 private:
  struct State {
    SensorClock clock;
    bool is_silent = false;
  };
  const State& state(Sensor sensor) const { return states_[static_cast<std::size_t>(sensor)]; }
  State& state(Sensor sensor) { return states_[static_cast<std::size_t>(sensor)]; }
  double silent_s(Sensor sensor) const;
  std::optional<model::Utime> newest_but(Sensor sensor) const;

  FaultParameters parameters_;
  ImuParameters imu_;
  std::vector<State> states_;
  std::optional<model::ImuSample> same_since_;
  bool is_frozen_ = false;
};

}  // namespace understory::lidar_imu_input
