// What HEALTH says of the filter beside faults of single messages.
#pragma once

#include <array>

#include "common/bus/condition.hpp"
#include "services/ekf/counters.hpp"
#include "services/ekf/ekf_report.hpp"

namespace understory::ekf {

/// When the filter is not well. Ranges and meanings: describe().
struct HealthParameters {
  int min_observations = 3;    ///< A scan with fewer says nothing about landmarks.
  double lost_sigma_m = 20.0;  ///< Of the position, along its worst axis.
  double nis_sigmas = 4.0;     ///< Of a scan's innovations, as a normal deviate.
  double nis_ratio = 1.7;      ///< The same, by its expectation.
  bus::ConditionLimits lost{20, 10};
  bus::ConditionLimits diverged{20, 6};
  bus::ConditionLimits restarted{50, 1};
  bus::ConditionLimits refused{64, 32};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Judges the filter by its latest messages. `lost`: landmarks come and none is used, or the
/// position has become less certain than `lost_sigma_m`. `diverged`: scan after
/// scan the innovations are larger than stated. Of a filter whose noise is white and as stated at
/// most 3 scans in 1000 are so by chance (chi^2 of 6 degrees of freedom; fewer with more
/// landmarks), and 6 of 20 once in 10^10. `restarted`: the map began anew. `input_refused`:
/// odometry or scans that are late or broken.
class HealthWatch {
 public:
  /// All is well so far.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// What a message gave, with the filter's counts before and after it.
  void add(const EkfOutput& output, const EkfCounters& before, const EkfCounters& after);
  /// What to show.
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
  /// False where the latest map began without a known place, as after a long pause: how certain the
  /// vehicle's place in the frame of before is does not matter any more.
  bool knows_place_ = true;
  bool has_restarted_ = false;  ///< And no scan since.
  bus::WatchedCondition lost_;
  bus::WatchedCondition diverged_;
  bus::WatchedCondition restarted_;
  bus::WatchedCondition refused_;
};

}  // namespace understory::ekf
