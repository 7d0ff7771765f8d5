// What HEALTH says of the associator beside faults of single messages.
#pragma once

#include <array>

#include "common/bus/condition.hpp"
#include "common/model/landmarks.hpp"
#include "services/associator/associator.hpp"

namespace understory::associator {

/// When the associator is not well. Ranges and meanings: describe().
struct HealthParameters {
  int min_detections = 3;       ///< A scan with fewer says nothing.
  int first_within_scans = 30;  ///< With detections; before the first association.
  bus::ConditionLimits lost{20, 8};
  bus::ConditionLimits refused{20, 10};
  bus::ConditionLimits misstated{20, 10};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Judges the associator by its latest scans. `lost`: detections come and nothing of them is
/// associated; at the start it has the time that tracks need to be confirmed. `input_refused`:
/// scans that are late. `noise_misstated`: scans contradict the covariances that LANDMARKS states,
/// and those that they show are used but not yet settled.
class HealthWatch {
 public:
  /// All is well so far.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// A scan, with the associator's counts before and after it.
  /// `is_misstated`: whether the stated noise is replaced by one that is not settled.
  void add(const model::LandmarkScan& scan, const AssociatorCounters& before,
           const AssociatorCounters& after, bool is_misstated = false);
  /// What to show.
  std::array<bus::WatchedCondition, 3> conditions() const { return {lost_, refused_, misstated_}; }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.lost_, self.refused_, self.misstated_, self.first_scans_);
  }

 private:
  HealthParameters parameters_;
  bus::WatchedCondition lost_;
  bus::WatchedCondition refused_;
  bus::WatchedCondition misstated_;
  int first_scans_ = 0;  ///< Before the first association; then `first_within_scans`.
};

}  // namespace understory::associator
