// Conditions of a service: what is wrong as long as it is wrong, by its latest events.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/bus/parameter_table.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// When a condition begins and ends. It counts events of its kind (scans, keyframes, messages), not
/// seconds: a slow vehicle and a fast one are judged alike.
struct ConditionLimits {
  int window = 20;    ///< Latest events that count; 1 .. 64.
  int raise_at = 10;  ///< Bad ones among them with which it begins; at most `window`.
};

/// Holds from `raise_at` bad events of the latest `window` until no more than a quarter of
/// `raise_at` is left: it does not flicker.
class Condition {
 public:
  /// Nothing was bad so far.
  explicit Condition(const ConditionLimits& limits = {}) : limits_(limits) {}

  /// The next event.
  void add(bool is_bad);
  /// Whether it holds now.
  bool holds() const { return holds_; }
  /// Bad ones of the latest events.
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
  std::string_view text;     ///< For a person.
  std::string_view channel;  ///< That it concerns; may be empty. Two of one reason differ in it.
  Condition condition;

  /// Members of a saved state; see common/state. The rest is constant.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.condition);
  }
};

/// Lists the limits as `health.NAME_window` and `health.NAME_raise_at`. `unit`: of the events;
/// `what`: which of them are bad.
void describe(ConditionLimits& limits, const std::string& name, const std::string& unit,
              const std::string& what, ParameterTable& table);

}  // namespace understory::bus
