// HEALTH of the filter, beside faults of single messages.
#pragma once

#include <array>

#include "common/bus/condition.hpp"
#include "services/ekf/counters.hpp"
#include "services/ekf/ekf_report.hpp"

namespace understory::ekf {

/// Limits of the filter's health conditions. Ranges and meanings: describe().
struct HealthParameters {
  int min_observations = 3;    ///< Scans with fewer observations are ignored.
  double lost_sigma_m = 20.0;  ///< Of the position, along its worst axis.
  double nis_sigmas = 4.0;     ///< Of a scan's innovations, as a normal deviate.
  double nis_ratio = 1.7;      ///< The same, relative to its expectation.
  bus::ConditionLimits lost{20, 10};
  bus::ConditionLimits diverged{20, 6};
  bus::ConditionLimits restarted{50, 1};
  bus::ConditionLimits refused{64, 32};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Derives the filter's health from its latest messages. `lost`: landmarks arrive and none is used,
/// or the uncertainty of the position exceeds `lost_sigma_m`. `diverged`: in many scans the
/// innovations are larger than stated. If the noise is white and as stated, this holds for at most
/// 3 scans in 1000 by chance (chi^2 of 6 degrees of freedom; fewer with more landmarks), and for 6
/// of 20 once in 10^10. `restarted`: the map began anew. `input_refused`: odometry or scans are
/// late or invalid.
class HealthWatch {
 public:
  /// No condition is raised.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// The outputs for a message, with the filter's counts before and after it.
  void add(const EkfOutput& output, const EkfCounters& before, const EkfCounters& after);
  /// The conditions for HEALTH.
  std::array<bus::WatchedCondition, 4> conditions() const {
    return {lost_, diverged_, restarted_, refused_};
  }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.knows_place_, self.has_restarted_, self.lost_, self.diverged_, self.restarted_,
      self.refused_);
  }

 private:
  void add_scan(const ScanFit& scan, const model::EkfPose& pose);

  HealthParameters parameters_;
  /// False if the latest map began at an unknown pose, as after a long pause: then the vehicle's
  /// uncertainty in the earlier frame is irrelevant.
  bool knows_place_ = true;
  bool has_restarted_ = false;  ///< Without a scan since.
  bus::WatchedCondition lost_;
  bus::WatchedCondition diverged_;
  bus::WatchedCondition restarted_;
  bus::WatchedCondition refused_;
};

}  // namespace understory::ekf
