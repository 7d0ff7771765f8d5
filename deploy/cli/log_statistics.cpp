#include "deploy/cli/log_statistics.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "common/wire/convert.hpp"
#include "common/wire/guard.hpp"
#include "understory/config_t.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {
namespace {

constexpr std::int64_t kClockJumpUs = 10'000'000;
constexpr std::size_t kMostPrograms = 1000;

/// On these channels every process has its own sequence.
bool counted_per_process(std::string_view channel) {
  constexpr std::array<std::string_view, 3> kChannels{"HEALTH", "LOG", "CONFIG"};
  return std::find(kChannels.begin(), kChannels.end(), channel) != kChannels.end();
}

/// Difference of possibly hostile numbers.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  std::int64_t result = 0;
  return __builtin_sub_overflow(a, b, &result) ? 0 : result;
}

}  // namespace

double ChannelStatistics::rate_hz() const {
  const auto span_us = static_cast<double>(difference(last_utime, first_utime));
  return events > 1 && span_us > 0.0 ? 1e6 * static_cast<double>(events - 1) / span_us : 0.0;
}

void LogStatistics::add(const io::LogEvent& event) {
  auto& channel = channels_[event.channel];
  if (channel.events == 0) channel.first_utime = event.utime;
  channel.last_utime = event.utime;
  ++channel.events;
  channel.bytes += event.data.size();
  check_payload(event, channel);
  note_program(event);

  if (events_ == 0) {
    first_utime_ = event.utime;
  } else {
    const auto step = difference(event.utime, last_utime_);
    clock_back_ += step < 0 ? 1 : 0;
    clock_forward_ += step > kClockJumpUs ? 1 : 0;
    longest_silence_us_ = std::max(longest_silence_us_, step);
    const auto numbers = difference(event.number, last_number_);
    if (numbers > 1) missing_numbers_ += static_cast<std::uint64_t>(numbers - 1);
  }
  last_utime_ = event.utime;
  last_number_ = event.number;
  ++events_;
}

void LogStatistics::note_program(const io::LogEvent& event) {
  if (programs_.size() >= kMostPrograms) return;
  const auto note = [&](const auto& message) {
    if (message) programs_.emplace(message->process, message->version);
  };
  if (event.channel == "CONFIG") note(wire::decode_message<config_t>(event.data));
  if (event.channel == "HEALTH") note(wire::decode_message<health_t>(event.data));
}

void LogStatistics::check_payload(const io::LogEvent& event, ChannelStatistics& channel) {
  const auto fingerprint = wire::fingerprint_of(event.data);
  const wire::WireType* type = fingerprint ? wire::find_wire_type(*fingerprint) : nullptr;
  const std::string name{type != nullptr ? type->layout->name : std::string_view("?")};
  if (channel.type.empty()) channel.type = name;
  if (channel.type != name) channel.type = "mixed";
  if (type == nullptr) return;

  if (const auto refusal = check_bytes(event.data, *type)) {
    ++channel.malformed;
    channel.last_malformed = std::string(to_string(refusal->reason)) + ": " + refusal->detail;
    return;
  }

  if (!type->is_message || counted_per_process(event.channel)) return;
  const auto header = wire::header_of(event.data);
  if (!header) return;

  const auto [last, first_one] =
      last_headers_.try_emplace(event.channel, LastHeader{header->utime, header->sequence});
  if (first_one) return;

  const auto step = difference(header->sequence, last->second.sequence);
  if (step > 1) channel.lost += static_cast<std::uint64_t>(step - 1);
  if (step < 0) ++channel.restarts;
  if (step >= 0 && header->utime < last->second.utime) ++channel.stamps_back;
  last->second = {header->utime, header->sequence};
}

}  // namespace understory::cli
