#include "common/bus/reason_counts.hpp"

#include <algorithm>

namespace understory::bus {
namespace {

constexpr std::int64_t kLongAgo = -(std::int64_t{1} << 60U);

}  // namespace

bool is_malformed(wire::Reason reason) {
  switch (reason) {
    case wire::Reason::kTooShort:
    case wire::Reason::kTooLong:
    case wire::Reason::kWrongType:
    case wire::Reason::kBadCount:
    case wire::Reason::kBadString:
    case wire::Reason::kNotFinite:
    case wire::Reason::kOutOfRange:
    case wire::Reason::kNotSymmetric:
    case wire::Reason::kNotPositive:
    case wire::Reason::kInconsistent:
      return true;
    default:
      return false;
  }
}

Severity severity(wire::Reason reason) {
  switch (reason) {
    case wire::Reason::kDuplicate:
    case wire::Reason::kLate:
      return Severity::kNote;
    case wire::Reason::kStageFailed:
    case wire::Reason::kLost:
    case wire::Reason::kDiverged:
      return Severity::kError;
    default:
      return Severity::kDegraded;
  }
}

ReasonCounts::ReasonCounts(Clock clock)
    : clock_(std::move(clock)), last_degraded_us_(kLongAgo), last_error_us_(kLongAgo) {}

void ReasonCounts::add(std::string_view channel, wire::Reason reason, std::string_view text) {
  ++counts_[{std::string(channel), std::string(to_string(reason))}];
  const Severity how_bad = severity(reason);
  if (how_bad == Severity::kNote) return;

  (how_bad == Severity::kError ? last_error_us_ : last_degraded_us_) = clock_.monotonic_us();
  last_code_ = to_string(reason);
  last_text_ =
      channel.empty() ? std::string(text) : std::string(channel) + ": " + std::string(text);
  last_text_utime_ = clock_.wall_us();
}

void ReasonCounts::add_degraded(std::string_view code, std::string_view text) {
  last_degraded_us_ = clock_.monotonic_us();
  last_code_ = code;
  last_text_ = text;
  last_text_utime_ = clock_.wall_us();
}

bool ReasonCounts::hold(std::string_view channel, wire::Reason reason, std::string_view text) {
  const auto [entry, is_new] = holding_.try_emplace({std::string(channel), reason}, text);
  if (is_new) add(channel, reason, text);
  return is_new;
}

bool ReasonCounts::release(std::string_view channel, wire::Reason reason) {
  return holding_.erase({std::string(channel), reason}) > 0;
}

void ReasonCounts::set_refused(const DatagramFaults& faults) {
  for (std::size_t i = 0; i < kDatagramFaults; ++i) {
    const auto fault = static_cast<DatagramFault>(i);
    const auto count = static_cast<std::int64_t>(faults.count_of(fault));
    if (count == 0 || faults.count_of(fault) == refused_.count_of(fault)) continue;

    counts_[{std::string(), std::string(to_string(fault))}] = count;
    if (!is_harmful(fault)) continue;
    add_degraded(to_string(fault),
                 "datagrams that are no message of LCM: " + std::to_string(count) + " so far");
  }
  refused_ = faults;
}

Severity ReasonCounts::fresh() const {
  Severity worst = Severity::kNote;
  for (const auto& [key, text] : holding_) worst = std::max(worst, severity(key.second));

  const std::int64_t now = clock_.monotonic_us();
  if (now - last_error_us_ < kFreshUs) return Severity::kError;
  if (now - last_degraded_us_ < kFreshUs) return std::max(worst, Severity::kDegraded);
  return worst;
}

std::int64_t ReasonCounts::count_of(std::string_view channel, wire::Reason reason) const {
  const auto found = counts_.find({std::string(channel), std::string(to_string(reason))});
  return found == counts_.end() ? 0 : found->second;
}

void ReasonCounts::fill(health_t& message) const {
  message.last_error_code = last_code_;
  message.last_error = last_text_;
  message.last_error_utime = last_text_utime_;
  Severity worst = Severity::kNote;
  for (const auto& [key, text] : holding_) {
    if (severity(key.second) <= worst) continue;
    worst = severity(key.second);
    message.last_error_code = to_string(key.second);
    message.last_error = key.first.empty() ? text : key.first + ": " + text;
    message.last_error_utime = clock_.wall_us();
  }

  for (const auto& [where, count] : counts_) {
    reason_count_t& reason = message.reasons.emplace_back();
    reason.channel = where.first;
    reason.reason = where.second;
    reason.count = count;
  }
  message.num_reasons = static_cast<std::int32_t>(message.reasons.size());
}

}  // namespace understory::bus
