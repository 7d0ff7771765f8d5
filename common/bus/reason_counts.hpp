// Faults of a process: count, latest occurrence and severity.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "common/bus/clock.hpp"
#include "common/bus/datagram_fault.hpp"
#include "common/wire/result.hpp"
#include "understory/health_t.hpp"

namespace understory::bus {

/// Severity of a reason while it is fresh (ReasonCounts::kFreshUs).
enum class Severity : std::uint8_t {
  kNote,      ///< Counted; the state stays OK.
  kDegraded,  ///< Input or output is missing or wrong.
  kError,     ///< The service does not fulfil its function.
};
/// The severity of each reason.
Severity severity(wire::Reason reason);
/// Whether the reason is a fault of a message's content.
bool is_malformed(wire::Reason reason);

/// Counts reasons by channel and keeps the last one.
class ReasonCounts {
 public:
  /// Time for which a reason affects the state [us].
  static constexpr std::int64_t kFreshUs = 3000000;

  /// Starts without faults.
  explicit ReasonCounts(Clock clock);

  /// Counts a reason; `channel` may be empty; `text` is for people.
  void add(std::string_view channel, wire::Reason reason, std::string_view text);
  /// A condition begins; it affects the state until its end. `text` is for people. False where it
  /// held already.
  bool hold(std::string_view channel, wire::Reason reason, std::string_view text);
  /// A condition ends. False where it did not hold before.
  bool release(std::string_view channel, wire::Reason reason);
  /// Sets how many datagrams the bus refused so far; an increase of a harmful one becomes the
  /// last reason.
  void set_refused(const DatagramFaults& faults);
  /// Sets the last reason to `code` for a loss that is counted elsewhere (by channel, by datagram).
  /// `text` is for people.
  void add_degraded(std::string_view code, std::string_view text);

  /// The worst severity of fresh reasons and present conditions; kNote = none.
  Severity fresh() const;
  /// Count of this reason on this channel.
  std::int64_t count_of(std::string_view channel, wire::Reason reason) const;
  /// Writes the counts and the last reason into the message for HEALTH; the worst present
  /// condition, if any, is the last reason.
  void fill(health_t& message) const;

 private:
  Clock clock_;
  DatagramFaults refused_;
  std::map<std::pair<std::string, std::string>, std::int64_t> counts_;   // channel, reason
  std::map<std::pair<std::string, wire::Reason>, std::string> holding_;  // channel, reason; text
  std::int64_t last_degraded_us_;
  std::int64_t last_error_us_;
  std::string last_code_;
  std::string last_text_;
  std::int64_t last_text_utime_ = -1;
};

}  // namespace understory::bus
