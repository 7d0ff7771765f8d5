#include "common/bus/condition.hpp"

#include <bit>

namespace understory::bus {
namespace {

constexpr int kMostEvents = 64;

}  // namespace

int Condition::bad() const {
  const std::uint64_t window =
      limits_.window >= kMostEvents ? ~std::uint64_t{0} : (std::uint64_t{1} << limits_.window) - 1;
  return std::popcount(bits_ & window);
}

void Condition::add(bool is_bad) {
  bits_ = (bits_ << 1U) | (is_bad ? 1U : 0U);
  holds_ = bad() >= limits_.raise_at || (holds_ && bad() > limits_.raise_at / 4);
}

void describe(ConditionLimits& limits, const std::string& name, const std::string& unit,
              const std::string& what, ParameterTable& table) {
  table.add("health." + name + "_window", limits.window, {1, kMostEvents}, unit,
            "Latest events that HEALTH judges; bad ones: " + what);
  table.add("health." + name + "_raise_at", limits.raise_at, {1, kMostEvents}, unit,
            "HEALTH is not OK from this many bad ones on, until a quarter of them is left.");
}

}  // namespace understory::bus
