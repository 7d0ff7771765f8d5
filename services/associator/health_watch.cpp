#include "services/associator/health_watch.hpp"

#include <algorithm>

namespace understory::associator {

void describe(HealthParameters& p, bus::ParameterTable& table) {
  table.add("health.min_detections", p.min_detections, {1, 10000}, "",
            "Scans with fewer detections are not judged.");
  table.add("health.first_within_scans", p.first_within_scans, {0, 1000000}, "scans",
            "Scans with detections from the start within which the first association must come.");
  describe(p.lost, "lost", "scans", "those without an association.", table);
  describe(p.refused, "refused", "scans", "those that came late or twice.", table);
  describe(p.misstated, "misstated", "scans",
           "those whose stated noise is replaced by the learned one, until that is settled (200 "
           "scans without a change).",
           table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : parameters_(parameters),
      lost_{wire::Reason::kLost, "detections come, and none is of a landmark that is tracked", "",
            bus::Condition(parameters.lost)},
      refused_{wire::Reason::kInputRefused, "scans are not later than those before", "",
               bus::Condition(parameters.refused)},
      misstated_{wire::Reason::kNoiseMisstated,
                 "the scans contradict the covariances of LANDMARKS; what they show is used", "",
                 bus::Condition(parameters.misstated)} {}

void HealthWatch::add(const model::LandmarkScan& scan, const AssociatorCounters& before,
                      const AssociatorCounters& after, bool is_misstated) {
  const bool is_refused = after.scans_refused > before.scans_refused;
  refused_.condition.add(is_refused);
  if (!is_refused) misstated_.condition.add(is_misstated);
  if (is_refused || scan.detections.size() < static_cast<std::size_t>(parameters_.min_detections)) {
    return;
  }

  const bool is_associated = after.published > before.published;
  first_scans_ = is_associated ? parameters_.first_within_scans
                               : std::min(first_scans_ + 1, parameters_.first_within_scans);
  lost_.condition.add(!is_associated && first_scans_ >= parameters_.first_within_scans);
}

}  // namespace understory::associator
