#include "common/bus/announcer.hpp"

#include <algorithm>
#include <bit>

#include "common/bus/reason_counts.hpp"
#include "common/wire/guard.hpp"
#include "understory/config_t.hpp"
#include "understory/log_t.hpp"

namespace understory::bus {

Announcer::Announcer(Bus& bus, std::string process, std::string version)
    : bus_(bus), process_(std::move(process)), version_(std::move(version)) {}

void Announcer::log(std::int64_t utime, LogLevel level, std::string_view code,
                    std::string_view text, std::string_view channel) {
  if (is_muted_) return;

  log_t message{};
  message.utime = std::max<std::int64_t>(utime, 0);
  message.seq = log_sequence_++;
  message.process = process_;
  message.level = static_cast<std::int8_t>(level);
  message.channel = channel;
  message.code = code;
  message.text = text;
  bus_.publish("LOG", wire::encode_bytes(message));
}

void Announcer::report(std::int64_t utime, wire::Reason reason, std::string_view text,
                       std::string_view channel) {
  const std::uint64_t count = ++reported_[{std::string(to_string(reason)), std::string(channel)}];
  if (!std::has_single_bit(count)) return;

  std::string line(text);
  if (count > 1) line += " (" + std::to_string(count) + " so far)";
  const bool is_note = severity(reason) == Severity::kNote;
  log(utime, is_note ? LogLevel::kInfo : LogLevel::kWarning, to_string(reason), line, channel);
}

void Announcer::report_refused(std::int64_t utime, const DatagramFaults& faults) {
  if (is_muted_) return;
  for (std::size_t i = 0; i < kDatagramFaults; ++i) {
    const auto fault = static_cast<DatagramFault>(i);
    const std::uint64_t count = faults.count_of(fault);
    if (count == 0 || count < 2 * refused_.count_of(fault)) continue;
    refused_.set(fault, count);
    const std::string so_far = " (" + std::to_string(count) + " so far)";
    if (is_harmful(fault)) {
      log(utime, LogLevel::kWarning, to_string(fault),
          "a datagram on the bus is no message of LCM" + so_far, {});
    } else {
      log(utime, LogLevel::kInfo, to_string(fault), "a datagram came twice" + so_far, {});
    }
  }
}

void Announcer::config(std::int64_t utime, const std::string& toml) {
  config_t message{};
  message.utime = std::max<std::int64_t>(utime, 0);
  message.seq = config_sequence_++;
  message.process = process_;
  message.version = version_;
  message.toml = toml;
  bus_.publish("CONFIG", wire::encode_bytes(message));
}

}  // namespace understory::bus
