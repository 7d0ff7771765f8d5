#include "services/associator/health_watch.hpp"

#include <algorithm>

namespace understory::associator {

void describe(HealthParameters& p, bus::ParameterTable& table) {
  table.add("health.min_detections", p.min_detections, {1, 10000}, "",
            "A scan with fewer detections says nothing about the associator.");
  table.add("health.first_within_scans", p.first_within_scans, {0, 1000000}, "scans",
            "From the start so many scans with detections are given for the first association.");
  describe(p.lost, "lost", "scans", "bad are those of which nothing could be associated.", table);
  describe(p.refused, "refused", "scans", "bad are those that came late or twice.", table);
  describe(p.misstated, "misstated", "scans",
           "bad are those whose stated noise is contradicted by the scans and not yet replaced by "
           "what explains them.",
           table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : parameters_(parameters),
      lost_{wire::Reason::kLost, "detections come, and none is of a landmark that is tracked", "",
            bus::Condition(parameters.lost)},
      refused_{wire::Reason::kInputRefused, "scans are not later than those before", "",
               bus::Condition(parameters.refused)},
      misstated_{wire::Reason::kNoiseMisstated, "", "", bus::Condition(parameters.misstated)} {}

std::array<bus::WatchedCondition, 3> HealthWatch::conditions() const {
  bus::WatchedCondition misstated = misstated_;
  misstated.text = misstated_text_;
  return {lost_, refused_, misstated};
}

void HealthWatch::judge(const model::NoiseVerdict& noise) {
  const bool was_open = misstated_.condition.holds();
  misstated_.condition.add(noise.is_open());
  if (!was_open && misstated_.condition.holds()) misstated_text_ = contradiction_text(noise);
  if (auto note = news_.add(noise)) note_ = std::move(note);
}

void HealthWatch::add(const model::LandmarkScan& scan, const AssociatorCounters& before,
                      const AssociatorCounters& after, const model::NoiseVerdict& noise) {
  const bool is_refused = after.scans_refused > before.scans_refused;
  refused_.condition.add(is_refused);
  if (!is_refused) judge(noise);
  if (is_refused || scan.detections.size() < static_cast<std::size_t>(parameters_.min_detections)) {
    return;
  }

  const bool is_associated = after.published > before.published;
  first_scans_ = is_associated ? parameters_.first_within_scans
                               : std::min(first_scans_ + 1, parameters_.first_within_scans);
  lost_.condition.add(!is_associated && first_scans_ >= parameters_.first_within_scans);
}

}  // namespace understory::associator
