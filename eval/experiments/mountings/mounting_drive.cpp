#include "eval/experiments/mountings/mounting_drive.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::mountings {
namespace {

/// A drive goes on for so long after the right sensor was named [s].
constexpr double kListens_s = 3.0;
/// Chi-squared of three degrees of freedom with the probability of 3 sigma.
constexpr double kThreeSigma = 14.16;
/// Variance [m^2, rad^2] below which a figure is exact: a map's first pose.
constexpr double kExact = 1e-12;
constexpr double kHasMoved_m = 0.1;

constexpr std::pair<const char*, sim::PathKind> kPaths[] = {
    {"circle", sim::PathKind::kCircle},
    {"figure-eight", sim::PathKind::kFigureEight},
    {"line", sim::PathKind::kLine},
    {"meander", sim::PathKind::kMeander},
};

/// The sensor that a channel of HEALTH is about; LANDMARKS are of the laser, ODOMETRY of the
/// wheels.
Culprit culprit_of(std::string_view channel) {
  if (channel == "RAW_IMU" || channel == "IMU") return Culprit::kImu;
  if (channel == "RAW_SWEEP" || channel == "LIDAR_SWEEP" || channel == "LANDMARKS")
    return Culprit::kLidar;
  if (channel == "RAW_WHEELS" || channel == "WHEELS" || channel == "ODOMETRY")
    return Culprit::kWheels;
  return Culprit::kNone;
}

/// Scores poses as they come. Each frame is tied to the truth by its first pose.
class PoseJudge {
 public:
  explicit PoseJudge(const std::vector<metrics::StampedPose>& truth) : truth_(truth) {}

  void add(model::Utime utime, std::uint32_t frame, const geometry::SE2& frame_T_vehicle,
           const Eigen::Matrix3d& covariance) {
    const auto is = metrics::pose_at(truth_, utime);
    if (!is) return;
    const geometry::SE2 frame_T_truth =
        frames_.try_emplace(frame, frame_T_vehicle * is->inverse()).first->second * *is;
    const Eigen::Vector3d off = (frame_T_vehicle.inverse() * frame_T_truth).coordinates();
    const Eigen::Matrix3d floored = covariance + kExact * Eigen::Matrix3d::Identity();
    const double nees = off.dot(floored.llt().solve(off));
    ++score_.poses;
    if (nees > kThreeSigma) ++score_.outside;
    score_.largest_m = std::max(score_.largest_m, off.head<2>().norm());
    score_.largest_sigmas = std::max(score_.largest_sigmas, std::sqrt(nees));
  }
  const PoseScore& score() const { return score_; }

 private:
  const std::vector<metrics::StampedPose>& truth_;
  std::map<std::uint32_t, geometry::SE2> frames_;
  PoseScore score_;
};

/// What HEALTH of all services says, and when it was first said.
class Listener {
 public:
  Listener(harness::SensorChain& chain, const MountingFault& fault)
      : chain_(chain), culprit_(fault.culprit), is_late_(fault.late_s != 0.0) {}

  void listen(double at_s) {
    for (const std::string& service : chain_.services()) {
      for (const reason_count_t& reason : chain_.health_of(service).reasons)
        hear(service, reason, at_s);
    }
  }
  bool has_named() const { return verdict_.named_s.has_value(); }
  MountingVerdict take() { return std::move(verdict_); }

 private:
  void hear(const std::string& service, const reason_count_t& reason, double at_s) {
    const std::string what = fmt::format("{} {} {}", service, reason.reason, reason.channel);
    // A sensor whose messages are refused one after another is named by that.
    const bool names = reason.reason == "miscalibrated" || reason.reason == "input_refused";
    if (!verdict_.heard.try_emplace(what, at_s).second || !names) return;

    const bool is_clock = reason.channel.empty();
    if (is_clock ? is_late_
                 : culprit_ != Culprit::kNone && culprit_of(reason.channel) == culprit_) {
      if (has_named()) return;
      verdict_.named_s = at_s;
      verdict_.named_as = service + ": " + reason.channel;
    } else {
      verdict_.blamed.try_emplace(what, at_s);
    }
  }

  harness::SensorChain& chain_;
  Culprit culprit_;
  bool is_late_;  ///< Without a channel HEALTH means a clock.
  MountingVerdict verdict_;
};

/// The messages of a reading, after the fault.
std::vector<harness::RawMessage> messages_of(const MountingFault& fault, auto reading,
                                             std::uint64_t& sweep_parts) {
  apply(fault, reading);
  if constexpr (std::is_same_v<decltype(reading), model::PointSweep>) {
    return harness::raw_messages(sim::SimulatedSweep{std::move(reading), {}, {}}, sweep_parts);
  } else {
    return harness::raw_messages(reading, sweep_parts);
  }
}

}  // namespace

ReadingTape record_readings(double length_m, std::uint64_t seed) {
  const auto& [name, path] = kPaths[seed % std::size(kPaths)];
  sim::ForestScenarioParameters forest;
  forest.path = path;
  forest.length_m = length_m;
  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 900;
  sim::SensorDrive drive(sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed);

  ReadingTape tape;
  tape.path = name;
  while (auto reading = drive.next()) {
    terminal::throw_if_interrupted();
    if (const auto* pose = std::get_if<sim::TruePose>(&*reading)) {
      tape.truth.push_back({pose->utime, pose->state.world_T_level()});
    } else if (auto* sweep = std::get_if<sim::SimulatedSweep>(&*reading)) {
      tape.readings.emplace_back(std::move(sweep->raw));
    } else if (const auto* imu = std::get_if<model::ImuSample>(&*reading)) {
      tape.readings.emplace_back(*imu);
    } else if (const auto* wheels = std::get_if<model::WheelSample>(&*reading)) {
      tape.readings.emplace_back(*wheels);
    }
  }

  const auto moves = std::ranges::find_if(tape.truth, [&](const metrics::StampedPose& pose) {
    return (pose.pose.translation() - tape.truth.front().pose.translation()).norm() > kHasMoved_m;
  });
  if (moves != tape.truth.end()) tape.moves_at_s = 1e-6 * static_cast<double>(moves->utime);
  return tape;
}

MountingVerdict drive(const ReadingTape& tape, const MountingFault& fault,
                      const std::filesystem::path& config_dir) {
  harness::SensorChain chain(harness::services_of(config_dir), config_dir);
  Listener listener(chain, fault);
  PoseJudge slam(tape.truth);
  PoseJudge filter(tape.truth);
  chain.watch<model::SlamPose>("SLAM_POSE", [&](const model::SlamPose& pose) {
    if (pose.is_localised() && !listener.has_named())
      slam.add(pose.utime, pose.map_id, pose.map_T_vehicle(), pose.covariance);
  });
  chain.watch<model::EkfPose>("EKF_POSE", [&](const model::EkfPose& pose) {
    if (!listener.has_named()) filter.add(pose.utime, 0, pose.ekf_map_T_vehicle, pose.covariance);
  });

  // The drive's time is that of the readings before the fault.
  std::uint64_t sweep_parts = 0;
  std::optional<double> ends_s;
  for (const auto& reading : tape.readings) {
    const double at_s = std::visit(
        [](const auto& value) { return 1e-6 * static_cast<double>(value.utime); }, reading);
    if (ends_s && at_s > *ends_s) break;
    const auto messages = std::visit(
        [&](const auto& value) { return messages_of(fault, value, sweep_parts); }, reading);
    for (const harness::RawMessage& message : messages) chain.feed(message);

    if (!std::holds_alternative<model::PointSweep>(reading)) continue;
    terminal::throw_if_interrupted();
    listener.listen(at_s - tape.moves_at_s);
    if (listener.has_named() && !ends_s) ends_s = std::max(at_s, tape.moves_at_s) + kListens_s;
  }

  MountingVerdict verdict = listener.take();
  verdict.slam = slam.score();
  verdict.filter = filter.score();
  return verdict;
}

}  // namespace understory::eval::experiments::mountings
