#include "services/loop_closer/health_watch.hpp"

namespace understory::loop_closer {

void describe(HealthParameters& p, bus::ParameterTable& table) {
  describe(p.refused, "refused", "closures", "those that the mapper refused.", table);
  describe(p.diverged, "diverged", "closures",
           "those that contradict the mapper's map and wait for others that agree.", table);
  describe(p.missing, "missing", "keyframes", "those in SLAM_UPDATE without a KEYFRAME.", table);
  describe(p.clouds, "clouds", "places",
           "those without a cloud, if detector or verifier compare clouds.", table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : refused_{wire::Reason::kInputRefused, "the mapper refuses loop closures", "LOOP_CLOSURE",
               bus::Condition(parameters.refused)},
      diverged_{wire::Reason::kDiverged,
                "loop closures contradict the map and wait for others that agree", "LOOP_RESULT",
                bus::Condition(parameters.diverged)},
      missing_{wire::Reason::kPartsMissing, "keyframes are missing that the mapper has", "KEYFRAME",
               bus::Condition(parameters.missing)},
      clouds_{wire::Reason::kPartsMissing,
              "places have no cloud to compare: place_scan.period_s of landmark_extractor",
              "PLACE_SCAN", bus::Condition(parameters.clouds)} {}

void HealthWatch::add(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  if (result.status == kRevoked) return;
  refused_.condition.add(result.status == kRefused);
  diverged_.condition.add(result.status == kWaiting);
}

void HealthWatch::add(const LoopCounters& before, const LoopCounters& after) {
  missing_.condition.add(after.keyframes_missing > before.keyframes_missing);
  const bool has_new = after.places > before.places;
  const bool has_none = after.without_cloud > before.without_cloud;
  if (has_new || has_none) clouds_.condition.add(has_none);
}

}  // namespace understory::loop_closer
