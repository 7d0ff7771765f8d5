// HEALTH of the loop closer, beside faults of single messages.
#pragma once

#include <array>

#include "common/bus/condition.hpp"
#include "common/model/submap.hpp"
#include "services/loop_closer/loop_closer.hpp"

namespace understory::loop_closer {

/// Limits of the loop closer's health conditions. Ranges and meanings: describe().
struct HealthParameters {
  bus::ConditionLimits refused{8, 4};
  bus::ConditionLimits diverged{16, 12};
  bus::ConditionLimits missing{20, 10};
  bus::ConditionLimits clouds{20, 10};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Derives the loop closer's health from the results of its closures. `input_refused`: the mapper
/// refuses them. `diverged`: they contradict its map, and wait for others that agree.
/// `parts_missing`: keyframes that the mapper received, or clouds for comparison, do not arrive.
class HealthWatch {
 public:
  /// No condition is raised.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// The mapper's result for one of our closures.
  void add(const model::LoopResult& result);
  /// An update of a keyframe, with the counts before and after it.
  void add(const LoopCounters& before, const LoopCounters& after);
  /// The conditions for HEALTH.
  std::array<bus::WatchedCondition, 4> conditions() const {
    return {refused_, diverged_, missing_, clouds_};
  }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.refused_, self.diverged_, self.missing_, self.clouds_);
  }

 private:
  bus::WatchedCondition refused_;
  bus::WatchedCondition diverged_;
  bus::WatchedCondition missing_;
  bus::WatchedCondition clouds_;
};

}  // namespace understory::loop_closer
