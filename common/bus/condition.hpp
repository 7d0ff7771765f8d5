// Conditions of a service: a fault that holds or not, judged by the latest events.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/bus/parameter_table.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// Limits for the begin and the end of a condition. It counts events (scans, keyframes, messages),
/// not seconds: a slow and a fast vehicle are judged alike.
struct ConditionLimits {
  int window = 20;    ///< Latest events that count; 1 .. 64.
  int raise_at = 10;  ///< It begins with this many bad events among them; at most `window`.
};

/// Begins at `raise_at` bad events among the latest `window` and ends at a quarter of `raise_at`:
/// this hysteresis prevents flicker.
class Condition {
 public:
  /// Starts without bad events.
  explicit Condition(const ConditionLimits& limits = {}) : limits_(limits) {}

  /// Adds the next event.
  void add(bool is_bad);
  /// Whether it holds now.
  bool holds() const { return holds_; }
  /// Number of bad events among the latest `window`.
  int bad() const;

  /// Members of a saved state; see common/state. The limits are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.bits_, self.holds_);
  }

 private:
  ConditionLimits limits_;
  std::uint64_t bits_ = 0;  ///< Bit k: the event k before the last one was bad.
  bool holds_ = false;
};

/// A condition with the reason that HEALTH shows while it holds.
struct WatchedCondition {
  wire::Reason reason = wire::Reason::kLost;
  std::string_view text;     ///< Text for people.
  std::string_view channel;  ///< Channel of the condition; may be empty. Two conditions of one
                             ///< reason differ in it.
  Condition condition;

  /// Members of a saved state; see common/state. The rest is constant.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.condition);
  }
};

/// Adds the limits to the table as `health.NAME_window` and `health.NAME_raise_at`. `unit`: unit of
/// the events; `what`: the bad events in words.
void describe(ConditionLimits& limits, const std::string& name, const std::string& unit,
              const std::string& what, ParameterTable& table);

}  // namespace understory::bus
