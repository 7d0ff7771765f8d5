#include "services/loop_closer/health_watch.hpp"

namespace understory::loop_closer {

void describe(HealthParameters& p, bus::ParameterTable& table) {
  describe(p.refused, "refused", "closures", "bad are those that the mapper refused.", table);
  describe(p.diverged, "diverged", "closures",
           "bad are those that contradict the mapper's map and wait for others that agree.", table);
  describe(p.missing, "missing", "keyframes",
           "bad are those of which the mapper tells and that did not come.", table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : refused_{wire::Reason::kInputRefused, "the mapper refuses loop closures", "LOOP_CLOSURE",
               bus::Condition(parameters.refused)},
      diverged_{wire::Reason::kDiverged,
                "loop closures contradict the map and wait for others that agree", "LOOP_RESULT",
                bus::Condition(parameters.diverged)},
      missing_{wire::Reason::kPartsMissing, "keyframes are missing that the mapper has", "KEYFRAME",
               bus::Condition(parameters.missing)} {}

void HealthWatch::add(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  if (result.status == kRevoked) return;
  refused_.condition.add(result.status == kRefused);
  diverged_.condition.add(result.status == kWaiting);
}

void HealthWatch::add(const LoopCounters& before, const LoopCounters& after) {
  missing_.condition.add(after.keyframes_missing > before.keyframes_missing);
}

}  // namespace understory::loop_closer
