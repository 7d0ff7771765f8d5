// HEALTH of the associator, beside faults of single messages.
#pragma once

#include <array>

#include "common/bus/condition.hpp"
#include "common/model/landmarks.hpp"
#include "services/associator/associator.hpp"

namespace understory::associator {

/// Limits of the associator's health conditions. Ranges and meanings: describe().
struct HealthParameters {
  int min_detections = 3;       ///< A scan with fewer is ignored.
  int first_within_scans = 30;  ///< With detections; before the first association.
  bus::ConditionLimits lost{20, 8};
  bus::ConditionLimits refused{20, 10};
  bus::ConditionLimits misstated{20, 10};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Derives the associator's health from its latest scans. `lost`: detections arrive and none is
/// associated; at the start the time for the confirmation of tracks is allowed. `input_refused`:
/// late scans. `noise_misstated`: scans contradict the covariances of LANDMARKS, and the estimated
/// covariances in use have not settled yet.
class HealthWatch {
 public:
  /// No condition is raised.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// A scan, with the associator's counts before and after it. `is_misstated`: the stated noise is
  /// replaced by an estimate that has not settled yet.
  void add(const model::LandmarkScan& scan, const AssociatorCounters& before,
           const AssociatorCounters& after, bool is_misstated = false);
  /// The conditions for HEALTH.
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
