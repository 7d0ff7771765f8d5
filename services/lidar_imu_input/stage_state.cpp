// Saving and loading the stage.
#include <stdexcept>
#include <utility>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "services/lidar_imu_input/state_archive.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::uint32_t kStateVersion = 3;
constexpr std::string_view kStateName = "lidar_imu_input";

}  // namespace

std::string LidarImuInput::save() const {
  Writer out;
  out(std::vector<char>(kStateName.begin(), kStateName.end()), kStateVersion);
  out(guard_, motion_, filter_motion_, counters_, increment_end_, sweep_stamp_, scan_stamp_,
      raw_pose_utime_, first_points_, calibration_reported_, was_saturated_);
  out(static_cast<std::uint64_t>(waiting_.size()));
  for (const Waiting& waiting : waiting_) {
    const auto* scan = std::get_if<model::PlanarScan>(&waiting.item);
    out(waiting.end, scan != nullptr ? std::optional(*scan) : std::nullopt);
  }
  return out.bytes();
}

void LidarImuInput::load(const std::string& state) {
  Reader in(state);
  std::vector<char> name;
  std::uint32_t version = 0;
  in(name, version);
  if (std::string_view(name.data(), name.size()) != kStateName || version != kStateVersion) {
    throw std::invalid_argument("state: of another stage or version");
  }
  in(guard_, motion_, filter_motion_, counters_, increment_end_, sweep_stamp_, scan_stamp_,
     raw_pose_utime_, first_points_, calibration_reported_, was_saturated_);
  std::uint64_t count = 0;
  in(count);
  waiting_.clear();
  for (std::uint64_t i = 0; i < count; ++i) {
    Waiting waiting;
    std::optional<model::PlanarScan> scan;
    in(waiting.end, scan);
    if (scan) waiting.item = *std::move(scan);
    waiting_.push_back(std::move(waiting));
  }
  if (!in.is_at_end() || !motion_.is_whole()) throw std::invalid_argument("state: it is not whole");
  guard_.resume();
  resumed_from_ = guard_.now();
}

/// A vehicle that was away for long may be anywhere, and its sensors at any temperature.
void LidarImuInput::check_pause(Sensor sensor, model::Utime raw, InputResults& out) {
  if (!resumed_from_) return;
  const model::Utime from = *std::exchange(resumed_from_, std::nullopt);
  const double pause_s = static_cast<double>(guard_.on_stage_time(sensor, raw) - from) * 1e-6;
  if (pause_s <= kLongestPause_s) return;
  const InputCounters counters = counters_;
  *this = LidarImuInput(parameters_);
  counters_ = counters;
  out.emplace_back(InputFault{InputFaultKind::kNotCalibrated, channel_of(sensor),
                              "the kept state is too old: calibrating anew"});
}

}  // namespace understory::lidar_imu_input
