// What the chain does when its sensors fail.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>

#include "eval/experiments/frontend/frontend.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::frontend {
namespace {

constexpr model::Utime kFaultBegins = 35'000'000;
constexpr model::Utime kFaultEnds = 40'000'000;
constexpr model::Utime kClockJump = 1'000'000;

bool is_faulty(model::Utime utime) { return utime >= kFaultBegins && utime < kFaultEnds; }

/// What SLAM_POSE may be off 5 s after a fault: twice what was measured. Without an IMU the heading
/// comes from wheels alone meanwhile.
constexpr double kLimit_m = 0.015;
constexpr double kLimitAfterImuFault_m = 0.04;

struct Fault {
  std::string name;
  std::function<harness::Meddle()> make;
  double limit_m = kLimit_m;
};

/// Decodes, changes, encodes again; bytes that cannot be decoded pass.
template <class Wire, class F>
harness::RawMessage changed(harness::RawMessage message, F change) {
  auto wire = wire::decode_bytes<Wire>(message.bytes);
  if (!wire) return message;
  change(*wire);
  message.utime = wire->utime;
  message.bytes = wire::encode_bytes(*wire);
  return message;
}

harness::Meddle silent(const std::string& channel) {
  return [channel](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    if (is_faulty(message.utime) && message.channel == channel) return {};
    return {std::move(message)};
  };
}

harness::Meddle half_lost() {
  auto random = std::make_shared<std::mt19937_64>(5);
  return [random](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    if (is_faulty(message.utime) && (*random)() % 2 == 0) return {};
    return {std::move(message)};
  };
}

harness::RawMessage at_other_time(harness::RawMessage message, model::Utime shift) {
  const auto move = [shift](auto& wire) { wire.utime += shift; };
  if (message.channel == "RAW_IMU") return changed<imu_t>(std::move(message), move);
  if (message.channel == "RAW_WHEELS") return changed<wheels_t>(std::move(message), move);
  if (message.channel == "RAW_SWEEP") return changed<lidar_sweep_t>(std::move(message), move);
  if (message.channel == "RAW_GNSS") return changed<gnss_t>(std::move(message), move);
  return message;
}

/// The stage follows the clock and shifts it back: its output's stamps go on as before.
harness::Meddle clock_back() {
  return [](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    if (message.utime < kFaultBegins) return {std::move(message)};
    return {at_other_time(std::move(message), -kClockJump)};
  };
}

/// Every point of the sweeps of one second is no number; on the wire that is refused by the guard.
harness::Meddle nan_sweeps() {
  return [](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    if (message.channel != "RAW_SWEEP" || message.utime < kFaultBegins ||
        message.utime >= kFaultBegins + 1'000'000) {
      return {std::move(message)};
    }
    return {changed<lidar_sweep_t>(std::move(message), [](lidar_sweep_t& sweep) {
      sweep.resolution_m = std::numeric_limits<double>::quiet_NaN();
    })};
  };
}

harness::Meddle saturated_imu() {
  return [](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    if (message.channel != "RAW_IMU" || !is_faulty(message.utime)) return {std::move(message)};
    return {changed<imu_t>(std::move(message), [](imu_t& imu) {
      imu.angular_rate_rad_s[2] = 1e3 * imu.angular_rate_rad_s[2] > 0 ? 8.0 : -8.0;
      imu.specific_force_m_s2[0] = 160.0;
    })};
  };
}

std::string reasons_of(const harness::ChainRun& run) {
  std::map<std::string, std::int64_t> counts;
  for (const auto& [service, health] : run.health) {
    for (const reason_count_t& reason : health.reasons) {
      counts[service + "/" + reason.reason] += reason.count;
    }
  }
  std::string text;
  for (const auto& [name, count] : counts) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, count);
  }
  return text.empty() ? "nothing" : text;
}

/// Greatest error of SLAM_POSE after `from`, in the gauge of the poses before the fault.
double error_after(const harness::ChainRun& run, model::Utime from) {
  const std::vector<metrics::StampedPose> poses = harness::poses_of(run.slam);
  std::optional<geometry::SE2> world_T_map;
  double largest = 0.0;
  std::size_t count = 0;
  for (const metrics::StampedPose& pose : poses) {
    const bool is_after = pose.utime >= from;
    const auto truth = pose_at(run.truth, pose.utime);
    if (!truth) continue;
    if (pose.utime < kFaultBegins) world_T_map = *truth * pose.pose.inverse();
    if (!is_after || !world_T_map) continue;
    largest =
        std::max(largest, (*world_T_map * pose.pose.translation() - truth->translation()).norm());
    ++count;
  }
  return count > 0 ? largest : std::numeric_limits<double>::quiet_NaN();
}

/// Few beams, so that the table can be made by a test.
sim::SensorDrive fault_drive(std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = 150.0;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 1200;
  return {sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed};
}

}  // namespace

void add_fault_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                    FrontendRows& rows) {
  const std::vector<Fault> faults = {
      {"no fault", [] { return harness::Meddle(); }},
      {"LIDAR silent for 5 s", [] { return silent("RAW_SWEEP"); }},
      {"IMU silent for 5 s", [] { return silent("RAW_IMU"); }, kLimitAfterImuFault_m},
      {"wheels silent for 5 s", [] { return silent("RAW_WHEELS"); }},
      {"half of all messages lost for 5 s", half_lost},
      {"all clocks 1 s back", clock_back},
      {"sweeps of NaN for 1 s", nan_sweeps},
      {"IMU saturated for 5 s", saturated_imu, kLimitAfterImuFault_m},
  };

  std::vector<harness::ChainRun> runs(faults.size());
  tools::run_in_parallel(faults.size(), options.jobs, "faults", stop, [&](std::size_t i) {
    sim::SensorDrive drive = fault_drive(options.seed);
    harness::ChainOptions chain;
    chain.config_dir = options.config_dir;
    chain.meddle = faults[i].make();
    runs[i] = drive_chain(drive, chain);
  });

  for (std::size_t i = 0; i < faults.size(); ++i) {
    rows.in(fmt::format("fault: {}; HEALTH counts {}", faults[i].name, reasons_of(runs[i])));
    rows.at_most("SLAM_POSE largest error 5 s after it",
                 error_after(runs[i], kFaultEnds + 5'000'000), "m", faults[i].limit_m);
    rows.at_most("wrong updates", static_cast<double>(wrong_updates(runs[i])), "", 0.0);
    rows.state("SLAM_POSE not sure", static_cast<double>(runs[i].slam_unsure), "");
  }
}

}  // namespace understory::eval::experiments::frontend
