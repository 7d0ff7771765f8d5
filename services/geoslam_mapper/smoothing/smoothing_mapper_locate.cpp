// Poses between keyframes: each scan is registered to the map as it is, which it does not change.
#include <algorithm>

#include "common/geometry/registration.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr double kReachMargin_m = 5.0;
constexpr double kLeastVariance = 1e-6;  ///< A millimetre, a milliradian.

}  // namespace

std::optional<geometry::SE2WithCovariance> SmoothingMapper::step_from_last_scan(
    const model::LandmarkScan& scan) const {
  if (!parameters_.use_odometry) return std::nullopt;
  return odometry_.between(located_->utime, scan.utime);
}

std::optional<geometry::SE2WithCovariance> SmoothingMapper::locate(const model::LandmarkScan& raw) {
  if (!located_ || raw.utime <= located_->utime) return std::nullopt;
  const model::LandmarkScan scan = level_.levelled(raw);
  const double reach = scan.field_of_view.max_range_m + kReachMargin_m;
  std::vector<geometry::UncertainPoint> reference;
  for (const model::LandmarkId id :
       store_.index().near({located_->map_T_vehicle.translation(), reach})) {
    const StoredLandmark& landmark = store_.at(id);
    reference.push_back({landmark.position_m, landmark.local_variance()});
  }
  std::vector<geometry::UncertainPoint> observed;
  for (const model::Detection& detection : scan.detections) {
    observed.push_back({detection.position_m.head<2>(),
                        0.5 * detection.covariance_m2.topLeftCorner<2, 2>().trace()});
  }
  const auto fits = [&](const geometry::Registration& found) {
    const double possible = static_cast<double>(std::min(reference.size(), observed.size()));
    return found.pairs.size() >= static_cast<std::size_t>(parameters_.min_matched) &&
           static_cast<double>(found.pairs.size()) >= parameters_.min_matched_ratio * possible;
  };
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;
  const auto step = step_from_last_scan(scan);
  const geometry::Registration found =
      step ? register_points(
                 reference, observed,
                 compound({located_->map_T_vehicle,
                           located_->covariance + kLeastVariance * Eigen::Matrix3d::Identity()},
                          *step),
                 gating)
           : register_step(reference, observed, located_->map_T_vehicle, located_->step,
                           geometry::StepModel{}, gating, fits);
  if (!fits(found)) return std::nullopt;
  const geometry::SE2 last = located_->map_T_vehicle;
  located_ = LocatedScan{scan.utime, found.reference_T_observed,
                         last.inverse() * found.reference_T_observed, found.covariance};
  return in_map(found);
}

/// The registration tells the pose among the landmarks near by, which share the error of the last
/// keyframe: the covariance is that of both.
geometry::SE2WithCovariance SmoothingMapper::in_map(const geometry::Registration& found) const {
  if (!map_T_last_base_) return {found.reference_T_observed, found.covariance};
  return compound(*map_T_last_base_, {map_T_last_base_->mean.inverse() * found.reference_T_observed,
                                      found.covariance});
}

}  // namespace understory::geoslam_mapper::smoothing
