#include "services/keyframer/joint/scan_tracker.hpp"

#include <algorithm>

namespace understory::keyframer::joint {
namespace {

/// Least variance of odometry [m^2, rad^2]: registration must be able to move its guess.
constexpr double kMotionFloor = 1e-8;

std::vector<geometry::UncertainPoint> observed_points(const model::LandmarkScan& scan) {
  std::vector<geometry::UncertainPoint> points;
  points.reserve(scan.detections.size());
  for (const model::Detection& detection : scan.detections) {
    points.push_back({detection.position_m.head<2>(), plane_variance(detection)});
  }
  return points;
}

}  // namespace

PlacedScan ScanTracker::restart(const model::LandmarkScan& scan) {
  map_.clear();
  scans_ = 1;
  local_T_vehicle_ = geometry::SE2();
  last_motion_ = geometry::SE2();
  return {local_T_vehicle_, map_.add(scan, {}, local_T_vehicle_)};
}

std::optional<PlacedScan> ScanTracker::add(
    const model::LandmarkScan& scan, const std::optional<geometry::SE2WithCovariance>& motion) {
  if (scans_ == 0) return restart(scan);

  const std::optional<geometry::Registration> found = locate(scan, motion);
  if (!found) return std::nullopt;

  ++scans_;
  last_motion_ = local_T_vehicle_.inverse() * found->reference_T_observed;
  local_T_vehicle_ = found->reference_T_observed;
  return PlacedScan{local_T_vehicle_, map_.add(scan, found->pairs, local_T_vehicle_)};
}

bool ScanTracker::fits(const geometry::Registration& registration,
                       const model::LandmarkScan& scan) const {
  const geometry::MatchQuota quota{static_cast<std::size_t>(parameters_.min_matched),
                                   parameters_.min_matched_ratio};
  const std::size_t matchable =
      map_.matchable(registration.reference_T_observed, scan.field_of_view);
  return quota.is_met(registration.pairs.size(), std::min(scan.detections.size(), matchable));
}

std::optional<geometry::Registration> ScanTracker::locate(
    const model::LandmarkScan& scan,
    const std::optional<geometry::SE2WithCovariance>& motion) const {
  const std::vector<geometry::UncertainPoint> reference = map_.reference_points();
  const std::vector<geometry::UncertainPoint> observed = observed_points(scan);
  geometry::RegistrationParameters registration;
  registration.gate_sigmas = parameters_.gate_sigmas;

  // Odometry gives the pose of a scan even without any match.
  if (motion) {
    const geometry::SE2WithCovariance guess{
        local_T_vehicle_ * motion->mean,
        motion->covariance + kMotionFloor * Eigen::Matrix3d::Identity()};
    return register_points(reference, observed, guess, registration);
  }

  // Without odometry the last motion is repeated, or headings are tried; the result must fit.
  const geometry::StepModel step{parameters_.motion_sigma_m, parameters_.motion_sigma_rad,
                                 parameters_.max_rotation_rad};
  geometry::Registration found =
      register_step(reference, observed, local_T_vehicle_, last_motion_, step, registration,
                    [&](const geometry::Registration& tried) { return fits(tried, scan); });
  if (!fits(found, scan)) return std::nullopt;
  return found;
}

}  // namespace understory::keyframer::joint
