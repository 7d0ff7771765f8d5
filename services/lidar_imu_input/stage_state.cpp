// Saving and loading the stage.
#include <stdexcept>
#include <utility>

#include "common/model/archive.hpp"
#include "common/state/archive.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr state::Format kFormat{"lidar_imu_input", 4};

}  // namespace

std::string LidarImuInput::save() const { return state::save(kFormat, *this); }

void LidarImuInput::load(const std::string& state) {
  LidarImuInput loaded(parameters_);
  state::load(state, kFormat, loaded);
  if (!loaded.motion_.is_whole()) throw std::invalid_argument("state: it is not whole");

  loaded.guard_.resume();
  loaded.resumed_from_ = loaded.guard_.now();
  *this = std::move(loaded);
}

/// The first message after loading shows how long the service was away.
void LidarImuInput::check_pause(Sensor sensor, model::Utime raw, InputResults& out) {
  if (!resumed_from_) return;
  const model::Utime from = *std::exchange(resumed_from_, std::nullopt);
  const double pause_s = static_cast<double>(guard_.on_stage_time(sensor, raw) - from) * 1e-6;
  if (pause_s <= kLongestPause_s) return;

  const InputCounters counters = counters_;
  *this = LidarImuInput(parameters_);
  counters_ = counters;
  out.emplace_back(InputFault{InputFaultKind::kNotCalibrated, channel_of(sensor),
                              "the saved state is too old: calibrating anew"});
}

}  // namespace understory::lidar_imu_input
