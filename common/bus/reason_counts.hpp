// What went wrong in a process: how often, when last, and how bad it is.
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

/// How bad a reason is while it is fresh (ReasonCounts::kFreshUs).
enum class Severity : std::uint8_t {
  kNote,      ///< Counted; the state stays OK.
  kDegraded,  ///< Input or output is missing or wrong.
  kError,     ///< The service does not do what it is for.
};
/// The severity of each reason.
Severity severity(wire::Reason reason);
/// Whether the reason is a fault of a message's content.
bool is_malformed(wire::Reason reason);

/// Counts reasons by channel and keeps the last one.
class ReasonCounts {
 public:
  /// A reason counts towards the state for this long [us].
  static constexpr std::int64_t kFreshUs = 3000000;

  /// Nothing was wrong so far.
  explicit ReasonCounts(Clock clock);

  /// Counts one; `channel` may be empty, `text` is for a person.
  void add(std::string_view channel, wire::Reason reason, std::string_view text);
  /// A condition holds from now on, and counts towards the state as long as it does; `text` is for
  /// a person. False where it held already.
  bool hold(std::string_view channel, wire::Reason reason, std::string_view text);
  /// A condition does not hold (any more). False where it did not hold before.
  bool release(std::string_view channel, wire::Reason reason);
  /// Sets how many datagrams the bus refused so far; an increase of a harmful one becomes the
  /// last reason.
  void set_refused(const DatagramFaults& faults);
  /// Something is missing that is counted elsewhere (by channel, by datagram): it is the last
  /// reason, of this code. `text` is for a person.
  void add_degraded(std::string_view code, std::string_view text);

  /// The worst severity that is fresh or of a condition that holds; kNote = nothing is.
  Severity fresh() const;
  /// How often this reason came for this channel.
  std::int64_t count_of(std::string_view channel, wire::Reason reason) const;
  /// Writes the counts and the last reason into the message for HEALTH; where conditions hold, the
  /// worst of them is the last reason.
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
