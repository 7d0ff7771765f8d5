#include "services/geoslam_mapper/smoothing/scan_localiser.hpp"

#include <algorithm>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Beyond the sensor's range, so that a landmark at its edge is found.
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

/// A pose among the landmarks near by, in the map: those share the error of the last keyframe, so
/// the covariance is that of both.
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

  // Landmarks end: odometry goes on, and its error with it.
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

/// By odometry where it reaches from the last scan, else by the last step and a search of
/// rotations. None where too few detections match.
std::optional<geometry::Registration> ScanLocaliser::register_scan(const model::LandmarkScan& scan,
                                                                   const LandmarkMap& landmarks,
                                                                   const Motion& motion) {
  const auto reference =
      landmarks_around(latest_->map_T_vehicle.translation(),
                       scan.field_of_view.max_range_m + kReachMargin_m, landmarks);
  const auto observed = points_of(scan);

  const geometry::MatchQuota quota{static_cast<std::size_t>(parameters_.min_matched),
                                   parameters_.min_matched_ratio};
  const auto fits = [&](const geometry::Registration& found) {
    return quota.is_met(found.pairs.size(), std::min(reference.size(), observed.size()));
  };
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;

  const geometry::SE2WithCovariance last{latest_->map_T_vehicle, latest_->covariance};
  const auto step = motion.between(latest_->utime, scan.utime);
  if (!step) {
    velocity_.forget();
    const auto found = register_step(reference, observed, last.mean, latest_->step,
                                     geometry::StepModel{}, gating, fits);
    return fits(found) ? std::optional(found) : std::nullopt;
  }

  // By the velocity; where the landmarks contradict it, by odometry as stated.
  const auto by_odometry = [&](const std::optional<model::InertialMotion>& inertial) {
    return register_points(reference, observed, velocity_.predict(last, *step, inertial), gating);
  };
  geometry::Registration found = by_odometry(motion.inertial(latest_->utime, scan.utime));
  if (fits(found) && velocity_.update({found.reference_T_observed, found.covariance})) return found;
  velocity_.forget();
  found = by_odometry(std::nullopt);
  return fits(found) ? std::optional(found) : std::nullopt;
}

}  // namespace understory::geoslam_mapper::smoothing
