#include "services/keyframer/health_watch.hpp"

#include <algorithm>
#include <cmath>

namespace understory::keyframer {
namespace {

/// Least significance of a wrong sensor against wrong wheels.
constexpr double kSensorSigmas = 6.0;
/// Limit of the watch's linear model [rad].
constexpr double kLinearYaw_rad = 0.15;

/// Whether it holds over the last minutes, or over the last seconds.
template <class Judge>
bool either(const InputQuality& quality, const Judge& judge) {
  return judge(quality.calibration) || judge(quality.lately);
}

}  // namespace

void describe(HealthParameters& p, bus::ParameterTable& table) {
  table.add("health.min_detections", p.min_detections, {1, 10000}, "",
            "Scans with fewer detections are not judged.");
  table.add(
      "health.keyframe_within_scans", p.keyframe_within_scans, {1, 1000000}, "scans",
      "After this many scans with detections and without a keyframe each further one is bad, too.");

  describe(p.lost, "lost", "scans", "those at which tracking started again.", table);
  describe(p.withheld, "withheld", "keyframes", "those that were withheld.", table);
  describe(p.refused, "refused", "scans", "those that came late or twice.", table);
  describe(
      p.misstated, "misstated", "scans",
      "those whose stated noise is replaced by the learned one, until that is settled (200 scans "
      "without a change), and those at which landmarks and wheels contradict each other.",
      table);
  describe(p.jumped, "jumped", "scans",
           "those whose steps by landmarks and by wheels differ by far more than both allow, and "
           "those with almost no match at the pose by odometry.",
           table);

  table.add("health.max_yaw_error_rad", p.max_yaw_error_rad, {0.001, 3.2}, "rad",
            "Yaw error of the landmarks' frame against the motion of the wheels from which the "
            "mounting is reported as wrong.");
  table.add(
      "health.max_place_error_m", p.max_place_error_m, {0.001, 100.0}, "m",
      "Position error of the landmarks' frame against the motion of the wheels, along either axis, "
      "from which the mounting is reported as wrong. Scans are reported as late or early from the "
      "time in which the vehicle moves by this, or turns by the largest yaw error.");
  table.add("health.max_scale_error", p.max_scale_error, {0.001, 1.0}, "",
            "Relative difference of distances by wheels and by landmarks from which the wheel "
            "scale is reported as wrong.");
  table.add("health.max_turn_chi2", p.max_turn_chi2, {1.0, 1000.0}, "",
            "Mean square of the difference between rotations by landmarks and by gyro, by its "
            "stated variance, from which scans are reported as shaken.");
  table.add("health.calibration_sigmas", p.calibration_sigmas, {1.0, 100.0}, "sigma",
            "Such an error is reported if it exceeds this many of its standard deviations.");
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : parameters_(parameters),
      lost_{wire::Reason::kLost, "tracking begins anew again and again, or no keyframe comes", "",
            bus::Condition(parameters.lost)},
      withheld_{wire::Reason::kWithheld, "keyframes are not good enough to give out", "",
                bus::Condition(parameters.withheld)},
      refused_{wire::Reason::kInputRefused, "scans are not later than those before", "",
               bus::Condition(parameters.refused)},
      misstated_{wire::Reason::kNoiseMisstated,
                 "the scans contradict the covariances of LANDMARKS; what they show is used", "",
                 bus::Condition(parameters.misstated)},
      shaken_{wire::Reason::kNoiseMisstated,
              "whole scans are turned against the gyro by more than is stated: vibration, stamps, "
              "or a gyro that is worse than stated",
              "LANDMARKS", bus::Condition(parameters.misstated)},
      jumped_{wire::Reason::kDiverged,
              "landmarks moved otherwise than odometry says: a jump, a clock, or wheels that slip",
              "", bus::Condition(parameters.jumped)},
      mounting_{wire::Reason::kMiscalibrated,
                "landmarks are turned or shifted against the way by wheels: the sensor's mounting",
                "LANDMARKS", bus::Condition(parameters.misstated)},
      late_{wire::Reason::kMiscalibrated,
            "scans are stamped late or early by a constant against odometry: a clock", "",
            bus::Condition(parameters.misstated)},
      scale_{wire::Reason::kMiscalibrated,
             "the way by wheels is longer or shorter than by landmarks: wheel scale, or the unit "
             "of the laser's ranges",
             "ODOMETRY", bus::Condition(parameters.misstated)} {}

void HealthWatch::judge(const InputQuality& quality) {
  misstated_.condition.add(quality.is_noise_misstated);
  shaken_.condition.add(either(quality, [this](const CalibrationError& error) {
    return error.turn_chi2 > parameters_.max_turn_chi2;
  }));
  jumped_.condition.add(quality.contradicts_odometry);
  const auto is_off = [this](double error, double sigma, double most) {
    return std::abs(error) > most && std::abs(error) > parameters_.calibration_sigmas * sigma;
  };
  // If the rotations disagree, the translations give no information on mounting or scale.
  const auto turns_agree = [this](const CalibrationError& error) {
    return error.turn_chi2 <= parameters_.max_turn_chi2;
  };
  mounting_.condition.add(either(quality, [&](const CalibrationError& error) {
    const double most_m = parameters_.max_place_error_m;
    const bool is_one = is_off(error.yaw_rad, error.yaw_sigma_rad, parameters_.max_yaw_error_rad) ||
                        is_off(error.place_m.x(), error.place_sigma_m.x(), most_m) ||
                        is_off(error.place_m.y(), error.place_sigma_m.y(), most_m);
    const bool is_large = std::abs(error.mount_yaw_rad) > parameters_.max_yaw_error_rad ||
                          error.mount_place_m.cwiseAbs().maxCoeff() > most_m;
    const bool is_either = is_large && error.sensor_sigmas > kSensorSigmas;
    return turns_agree(error) && (is_one || is_either);
  }));
  late_.condition.add(either(quality, [&](const CalibrationError& error) {
    const auto moves = [&](double speed, double most) {
      return is_off(speed * error.late_s, speed * error.late_sigma_s, most);
    };
    return moves(error.speed_mps, parameters_.max_place_error_m) ||
           moves(error.rate_rad_s, parameters_.max_yaw_error_rad);
  }));
  scale_.condition.add(either(quality, [&](const CalibrationError& error) {
    // The cosine of a large yaw error looks like a scale error.
    return turns_agree(error) && std::abs(error.yaw_rad) < kLinearYaw_rad &&
           is_off(error.scale, error.scale_sigma, parameters_.max_scale_error);
  }));
}

void HealthWatch::add(const model::LandmarkScan& scan, const KeyframerCounters& before,
                      const KeyframerCounters& after, const InputQuality& quality) {
  const bool is_refused = after.scans_refused > before.scans_refused;
  refused_.condition.add(is_refused);
  if (is_refused) return;
  judge(quality);

  const bool gave_one = after.keyframes > before.keyframes;
  const bool withheld_one = after.keyframes_withheld > before.keyframes_withheld;
  if (gave_one || withheld_one) withheld_.condition.add(!gave_one);
  if (gave_one) scans_without_keyframe_ = 0;

  if (scan.detections.size() < static_cast<std::size_t>(parameters_.min_detections)) return;
  if (!gave_one) ++scans_without_keyframe_;
  scans_without_keyframe_ =
      std::min(scans_without_keyframe_, parameters_.keyframe_within_scans + 1);
  lost_.condition.add(after.scans_unmatched > before.scans_unmatched ||
                      scans_without_keyframe_ > parameters_.keyframe_within_scans);
}

}  // namespace understory::keyframer
