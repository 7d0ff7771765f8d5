#include "services/geoslam_mapper/smoothing/scan_localiser.hpp"

#include <algorithm>

#include "services/geoslam_mapper/smoothing/few_matches.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Margin beyond the sensor's range, so that landmarks at its edge are found.
constexpr double kReachMargin_m = 5.0;

std::vector<geometry::UncertainPoint> landmarks_around(const Eigen::Vector2d& centre_m,
                                                       double radius_m,
                                                       const LandmarkMap& landmarks) {
  std::vector<geometry::UncertainPoint> points;
  for (const model::LandmarkId id : landmarks.index().near({centre_m, radius_m})) {
    if (landmarks.is_loose(id)) continue;
    const StoredLandmark& landmark = landmarks.at(id);
    points.push_back({landmark.position_m, landmark.local_variance()});
  }
  return points;
}

std::vector<geometry::UncertainPoint> points_of(const model::LandmarkScan& scan) {
  std::vector<geometry::UncertainPoint> points;
  for (const model::Detection& detection : scan.detections) {
    points.push_back({detection.position_m.head<2>(),
                      0.5 * detection.covariance_m2.topLeftCorner<2, 2>().trace()});
  }
  return points;
}

/// Number of points that could be matched: at most the number of landmarks in the field of view.
std::size_t count_possible(const model::FieldOfView& view, const geometry::SE2& map_T_vehicle,
                           std::span<const geometry::UncertainPoint> reference,
                           std::size_t observed) {
  const geometry::SE2 vehicle_T_map = map_T_vehicle.inverse();
  const auto in_view = std::ranges::count_if(reference, [&](const geometry::UncertainPoint& one) {
    return view.contains(vehicle_T_map * one.position_m);
  });
  return std::min(static_cast<std::size_t>(in_view), observed);
}

/// Converts a pose relative to the landmarks near by to the map: these share the error of the last
/// keyframe, so the covariances add up.
geometry::SE2WithCovariance in_map(
    const geometry::SE2WithCovariance& found,
    const std::optional<geometry::SE2WithCovariance>& map_T_last_base) {
  if (!map_T_last_base) return found;
  return compound(*map_T_last_base,
                  {map_T_last_base->mean.inverse() * found.mean, found.covariance});
}

}  // namespace

void ScanLocaliser::restart_at(model::Utime utime, const geometry::SE2WithCovariance& map_T_vehicle,
                               const geometry::SE2WithCovariance& map_T_base,
                               const Eigen::Matrix3d& common) {
  if (latest_ && latest_->utime > utime) return;
  latest_ =
      LocatedScan{utime, map_T_vehicle.mean, latest_ ? latest_->step : geometry::SE2(),
                  map_T_vehicle.covariance, in_map(map_T_vehicle, map_T_base).covariance + common};
  velocity_.set_pose();
}

std::optional<ScanPose> ScanLocaliser::locate(const model::LandmarkScan& raw,
                                              const LandmarkMap& landmarks, const Motion& motion,
                                              const Eigen::Matrix3d& common) {
  if (!latest_ || raw.utime <= latest_->utime) return std::nullopt;
  const auto found = register_scan(level_.levelled(raw), landmarks, motion);

  // Too few landmarks: odometry continues the pose, with a growing error.
  if (!found) {
    const auto step = motion.between(latest_->utime, raw.utime);
    if (!step) return std::nullopt;
    return ScanPose{compound({latest_->map_T_vehicle, latest_->map_covariance}, *step), true};
  }

  const geometry::SE2 pose = found->reference_T_observed;
  auto map_T_vehicle = in_map({pose, found->covariance}, motion.map_T_last_base());
  map_T_vehicle.covariance += common;
  latest_ = LocatedScan{raw.utime, pose, latest_->map_T_vehicle.inverse() * pose, found->covariance,
                        map_T_vehicle.covariance};
  return ScanPose{map_T_vehicle, false};
}

/// From odometry's prediction since the last scan, where few matches are sufficient; else from the
/// last step with a search of rotations. None if too few detections match.
std::optional<geometry::Registration> ScanLocaliser::register_scan(const model::LandmarkScan& scan,
                                                                   const LandmarkMap& landmarks,
                                                                   const Motion& motion) {
  const geometry::SE2WithCovariance last{latest_->map_T_vehicle, latest_->covariance};
  const auto step = motion.between(latest_->utime, scan.utime);
  const geometry::SE2 about = step ? last.mean * step->mean : last.mean;
  const double reach_m = scan.field_of_view.max_range_m + kReachMargin_m;
  const auto reference = landmarks_around(about.translation(), reach_m, landmarks);
  const auto observed = points_of(scan);

  const geometry::MatchQuota quota{static_cast<std::size_t>(parameters_.min_matched),
                                   parameters_.min_matched_ratio};
  const auto fits = [&](const geometry::Registration& found) {
    return quota.is_met(found.pairs.size(), std::min(reference.size(), observed.size()));
  };
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;

  if (!step) {
    velocity_.forget();
    const auto found = register_step(reference, observed, last.mean, latest_->step,
                                     geometry::StepModel{}, gating, fits);
    return fits(found) ? std::optional(found) : std::nullopt;
  }

  // With almost no possible matches, the few found add to odometry.
  const auto is_enough = [&](const geometry::Registration& found,
                             const geometry::SE2WithCovariance& guess) {
    if (fits(found)) return true;
    const std::size_t possible =
        count_possible(scan.field_of_view, found.reference_T_observed, reference, observed.size());
    const std::size_t clear = count_clear(found.pairs);
    return (quota.share_is_met(clear, possible) || possible < quota.min_matched) &&
           adds_to_odometry({reference, observed, guess, found}, gating, reach_m);
  };

  // Predicts by the velocity; if the landmarks contradict it, by odometry as stated.
  const auto by_odometry = [&](const std::optional<model::InertialMotion>& inertial)
      -> std::optional<geometry::Registration> {
    const geometry::SE2WithCovariance guess = velocity_.predict(last, *step, inertial);
    const geometry::Registration found = register_points(reference, observed, guess, gating);
    return is_enough(found, guess) ? std::optional(found) : std::nullopt;
  };
  const auto found = by_odometry(motion.inertial(latest_->utime, scan.utime));
  if (found && velocity_.update({found->reference_T_observed, found->covariance})) return found;
  velocity_.forget();
  return by_odometry(std::nullopt);
}

}  // namespace understory::geoslam_mapper::smoothing
