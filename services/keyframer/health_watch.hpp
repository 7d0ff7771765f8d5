// HEALTH of the keyframer, beside faults of single messages.
#pragma once

#include <array>
#include <cstdint>

#include "common/bus/condition.hpp"
#include "common/model/landmarks.hpp"
#include "services/keyframer/reports.hpp"

namespace understory::keyframer {

/// Limits of the keyframer's health conditions. Ranges and meanings: describe().
struct HealthParameters {
  int min_detections = 3;          ///< Scans with fewer are ignored.
  int keyframe_within_scans = 64;  ///< Scans with detections.
  bus::ConditionLimits lost{20, 8};
  bus::ConditionLimits withheld{8, 4};
  bus::ConditionLimits refused{20, 10};
  bus::ConditionLimits misstated{20, 10};
  bus::ConditionLimits jumped{50, 1};
  double max_yaw_error_rad = 0.0175;  ///< Of landmarks against wheels.
  double max_place_error_m = 0.04;    ///< Of the sensor, along either axis, or from late stamps.
  double max_scale_error = 0.025;     ///< Of wheels against landmarks.
  double max_turn_chi2 = 4.0;         ///< Of landmarks' turns against the gyro's, on average.
  double calibration_sigmas = 5.0;    ///< Least significance of such an error.
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// Derives the keyframer's health from its latest scans. `lost`: tracking restarts repeatedly, or
/// no keyframe is made although there are detections. `withheld`: keyframes are not good enough to
/// publish. `input_refused`: late scans. `noise_misstated`: scans contradict the covariances of
/// LANDMARKS, and the estimated covariances in use have not settled yet; or (channel LANDMARKS)
/// rotations of whole scans against the gyro are far larger than stated. `diverged`: the landmarks'
/// motion contradicts odometry, as after a jump or with slipping wheels. `miscalibrated`: landmarks
/// and odometry contradict each other beyond chance, in the yaw or the position of the mounting
/// (channel LANDMARKS), in the length of the path (channel ODOMETRY), or in their stamps (no
/// channel: either clock may be wrong).
class HealthWatch {
 public:
  /// No condition is raised.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// A scan, with the keyframer's counts before and after it.
  void add(const model::LandmarkScan& scan, const KeyframerCounters& before,
           const KeyframerCounters& after, const InputQuality& quality = {});
  /// The conditions for HEALTH; no two have channel and reason in common.
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
