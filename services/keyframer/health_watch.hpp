// What HEALTH says of the keyframer beside faults of single messages.
#pragma once

#include <array>
#include <cstdint>

#include "common/bus/condition.hpp"
#include "common/model/landmarks.hpp"
#include "services/keyframer/reports.hpp"

namespace understory::keyframer {

/// When the keyframer is not well. Ranges and meanings: describe().
struct HealthParameters {
  int min_detections = 3;          ///< A scan with fewer says nothing.
  int keyframe_within_scans = 64;  ///< Scans with detections.
  bus::ConditionLimits lost{20, 8};
  bus::ConditionLimits withheld{8, 4};
  bus::ConditionLimits refused{20, 10};
  bus::ConditionLimits misstated{20, 10};
  bus::ConditionLimits jumped{50, 1};
  double max_yaw_error_rad = 0.0175;  ///< Of landmarks against wheels.
  double max_place_error_m = 0.04;    ///< Of the sensor, along either axis, or by lateness.
  double max_scale_error = 0.025;     ///< Of wheels against landmarks.
  double max_turn_chi2 = 4.0;         ///< Of landmarks' turns against the gyro's, on average.
  double calibration_sigmas = 5.0;    ///< From which such an error counts.
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Judges the keyframer by its latest scans. `lost`: tracking begins anew again and again, or no
/// keyframe comes though detections do. `withheld`: keyframes are not good enough to give out.
/// `input_refused`: scans that are late. `noise_misstated`: scans contradict the covariances that
/// LANDMARKS states, and those that they show are used but not yet settled; or (channel LANDMARKS)
/// scans are turned as a whole against the gyro by far more than is stated. `diverged`: landmarks
/// moved otherwise than odometry says, as after a jump or where wheels slip. `miscalibrated`:
/// landmarks and odometry contradict each other by more than chance, in the yaw or the place of the
/// mounting (channel LANDMARKS), in the length of the way (channel ODOMETRY), or in their stamps
/// (no channel: either clock may be wrong).
class HealthWatch {
 public:
  /// All is well so far.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// A scan, with the keyframer's counts before and after it.
  void add(const model::LandmarkScan& scan, const KeyframerCounters& before,
           const KeyframerCounters& after, const InputQuality& quality = {});
  /// What to show; no two have channel and reason in common.
  std::array<bus::WatchedCondition, 9> conditions() const {
    return {lost_, withheld_, refused_, misstated_, shaken_, jumped_, mounting_, late_, scale_};
  }
  /// True while landmarks and wheels contradict each other.
  bool is_miscalibrated() const {
    return mounting_.condition.holds() || late_.condition.holds() || scale_.condition.holds();
  }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.lost_, self.withheld_, self.refused_, self.misstated_, self.shaken_, self.jumped_,
      self.mounting_, self.late_, self.scale_, self.scans_without_keyframe_);
  }

 private:
  void judge(const InputQuality& quality);

  HealthParameters parameters_;
  bus::WatchedCondition lost_;
  bus::WatchedCondition withheld_;
  bus::WatchedCondition refused_;
  bus::WatchedCondition misstated_;
  bus::WatchedCondition shaken_;
  bus::WatchedCondition jumped_;
  bus::WatchedCondition mounting_;
  bus::WatchedCondition late_;
  bus::WatchedCondition scale_;
  int scans_without_keyframe_ = 0;
};

}  // namespace understory::keyframer
