#include "deploy/cli/wrong_stretches.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

namespace understory::cli {
namespace {

/// Duration for which a HEALTH message is valid; it is published once a second.
constexpr std::int64_t kHealthLasts_us = 1'500'000;
/// Duration of a single fault in HEALTH.
constexpr std::int64_t kFaultLasts_us = 3'000'000;
constexpr std::string_view kOver = ": over";
/// Reasons that are conditions: they last until their end.
constexpr std::array<std::string_view, 8> kConditions{
    "lost",       "rolled_back",   "diverged",        "withheld",
    "not_stored", "miscalibrated", "noise_misstated", "new_map"};

bool is_bad(std::int8_t state) {
  return state == health_t::STATE_DEGRADED || state == health_t::STATE_ERROR;
}

}  // namespace

void AlarmCollector::take(const health_t& health, std::int64_t log_utime) {
  std::vector<ReceiveSpan>& spans = health_[health.process];
  if (is_bad(health.state)) spans.push_back({log_utime, log_utime + kHealthLasts_us});
}

void AlarmCollector::take(const log_t& message, std::int64_t log_utime) {
  std::vector<ReceiveSpan>& spans = logged_[message.process];
  std::string text = message.text;
  if (message.level >= log_t::LEVEL_WARNING) {
    spans.push_back({log_utime, log_utime + kFaultLasts_us});
    open_.insert_or_assign(Warning{message.process, message.channel, message.code, text},
                           log_utime);
    return;
  }

  if (!text.ends_with(kOver)) return;
  text.resize(text.size() - kOver.size());
  const auto open = open_.find(Warning{message.process, message.channel, message.code, text});
  if (open == open_.end()) return;
  spans.push_back({open->second, log_utime});
  open_.erase(open);
}

std::vector<ReceiveSpan> AlarmCollector::alarms() const {
  std::vector<ReceiveSpan> all;
  for (const auto& [process, spans] : health_) all.insert(all.end(), spans.begin(), spans.end());
  for (const auto& [process, spans] : logged_) {
    if (!health_.contains(process)) all.insert(all.end(), spans.begin(), spans.end());
  }
  for (const auto& [warning, since_us] : open_) {
    if (health_.contains(std::get<0>(warning))) continue;
    const bool holds = std::ranges::find(kConditions, std::get<2>(warning)) != kConditions.end();
    if (holds) all.push_back({since_us, std::numeric_limits<std::int64_t>::max()});
  }
  return all;
}

bool is_wrong(const ComparedPose& pose) {
  if (pose.position_error_m() <= kWrong_m) return false;
  const Eigen::LLT<Eigen::Matrix2d> root(pose.covariance.topLeftCorner<2, 2>());
  if (root.info() != Eigen::Success) return true;
  const Eigen::Vector3d error = (pose.world_T_vehicle.inverse() * pose.true_world_T_vehicle).Log();
  return error.head<2>().dot(root.solve(error.head<2>())) > kWrongSquaredSigmas;
}

std::vector<WrongStretch> wrong_stretches(std::span<const ComparedPose> poses,
                                          std::span<const ReceiveSpan> alarms) {
  std::vector<WrongStretch> stretches;
  for (const ComparedPose& pose : poses) {
    if (!is_wrong(pose)) continue;
    const bool goes_on =
        !stretches.empty() && pose.log_utime - stretches.back().span.to_us <= kTellWithin_us;
    if (!goes_on) stretches.push_back({{pose.log_utime, pose.log_utime}});
    WrongStretch& stretch = stretches.back();
    stretch.span.to_us = pose.log_utime;
    stretch.largest_error_m = std::max(stretch.largest_error_m, pose.position_error_m());
    ++stretch.poses;
  }

  for (WrongStretch& stretch : stretches) {
    const std::int64_t from_us = stretch.span.from_us;
    stretch.was_told = std::ranges::any_of(alarms, [&](const ReceiveSpan& alarm) {
      return alarm.from_us <= from_us + kTellWithin_us && alarm.to_us >= from_us;
    });
  }
  return stretches;
}

}  // namespace understory::cli
