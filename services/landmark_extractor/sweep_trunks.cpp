#include "services/landmark_extractor/sweep_trunks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory {
namespace {

/// Beams that pass the axis within this part of the radius must meet the stem.
constexpr double kCore = 0.6;
/// Returns so near the surface are on the stem.
constexpr double kOnStem_m = 0.12;
/// From here upwards a trunk must be seen where nothing hides it.
constexpr double kFoot_m = 0.5;

Eigen::Vector2d axis_variance(const StemFit& fit, double z) {
  const double above = z - fit.reference_z_m;
  const auto at = [&](int i) {
    return fit.covariance(i, i) + 2.0 * above * fit.covariance(i, i + 3) +
           above * above * fit.covariance(i + 3, i + 3);
  };
  return {at(0), at(1)};
}

/// The centre at breast height with its covariance.
Detection to_detection(const StemFit& fit, const GroundHeight& ground, double breast_height,
                       const Eigen::Matrix2d& level_covariance_rad2, double shape_sigma) {
  const double z = ground.height_m + breast_height;
  const double above = z - fit.reference_z_m;
  Eigen::Matrix<double, 2, 6> jacobian = Eigen::Matrix<double, 2, 6>::Zero();
  jacobian(0, 0) = jacobian(1, 1) = 1.0;
  jacobian(0, 3) = jacobian(1, 4) = above;
  Detection detection;
  detection.kind = LandmarkKind::kTrunk;
  detection.position_m << fit.centre_at(z), z;
  detection.radius_m = fit.radius_at(z);
  Eigen::Vector3d along_axis;
  along_axis << fit.state.segment<2>(3), 1.0;
  detection.covariance_m2 = ground.sigma_m * ground.sigma_m * along_axis * along_axis.transpose() +
                            from_level_error(detection.position_m, level_covariance_rad2);
  detection.covariance_m2.topLeftCorner<2, 2>() +=
      jacobian * fit.covariance * jacobian.transpose() +
      shape_sigma * shape_sigma * Eigen::Matrix2d::Identity();
  return detection;
}

double largest_sigma(const Eigen::Matrix2d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance, Eigen::EigenvaluesOnly)
          .eigenvalues()
          .maxCoeff());
}

enum class Met : std::uint8_t { kUnknown, kOn, kBeside, kThrough };

/// One ring's look at a stem.
struct Look {
  Met met = Met::kUnknown;
  double z_m = 0.0;
};

Look look(const RingCloud& cloud, std::size_t ring, const StemFit& fit, double clearance) {
  Look result;
  if (cloud.step_rad(ring) <= 0.0F) return result;
  const Eigen::Vector2d sensor = cloud.sensor_m().head<2>().cast<double>();
  const Eigen::Vector2d centre = fit.state.head<2>();
  const Eigen::Vector2d offset = centre - sensor;
  const double distance = offset.norm();
  const auto azimuth = static_cast<float>(std::atan2(offset.y(), offset.x()));
  std::size_t nearest = cloud.first_at(ring, azimuth);
  if (nearest >= cloud.ring_end(ring)) nearest = cloud.ring_end(ring) - 1;
  const RingPoint& any = cloud.points()[nearest];
  const double slope = (any.z_m - cloud.sensor_m().z()) / any.range_m;
  result.z_m = cloud.sensor_m().z() + slope * distance;
  const Eigen::Vector2d axis = fit.centre_at(result.z_m);
  const double radius = std::max(0.01, fit.radius_at(result.z_m));
  const double sigma = std::sqrt(axis_variance(fit, result.z_m).maxCoeff());
  const double reach = kCore * radius - sigma;
  if (reach <= 0.0) return result;
  // The beams around the axis; a few more on either side, as the axis may lean.
  const std::size_t begin =
      nearest > cloud.ring_begin(ring) + 8 ? nearest - 8 : cloud.ring_begin(ring);
  const std::size_t end = std::min(cloud.ring_end(ring), nearest + 9);
  for (std::size_t i = begin; i < end; ++i) {
    const RingPoint& point = cloud.points()[i];
    const Eigen::Vector2d direction(std::cos(point.azimuth_rad), std::sin(point.azimuth_rad));
    const Eigen::Vector2d to_axis =
        axis - (point.position() - static_cast<double>(point.range_m) * direction);
    const double miss = direction.x() * to_axis.y() - direction.y() * to_axis.x();
    if (std::abs(miss) > reach) continue;
    const double behind =
        point.range_m - (direction.dot(to_axis) - std::sqrt(radius * radius - miss * miss));
    if (std::abs(behind) <= kOnStem_m) {
      result.met = Met::kOn;
      return result;
    }
    if (behind > clearance) {
      result.met = result.met == Met::kBeside ? Met::kBeside : Met::kThrough;
    } else if (behind > -clearance) {
      result.met = Met::kBeside;
    }
  }
  return result;
}

}  // namespace

void SweepTrunks::find(const RingCloud& cloud, const std::vector<Run>& runs,
                       const GroundSurface& ground, const Eigen::Matrix2d& level_covariance_rad2,
                       std::vector<Detection>& detections) {
  const Eigen::Vector2f sensor = cloud.sensor_m().head<2>();
  const auto reach = static_cast<float>(sweep_.max_range_m) + 2.0F;
  for (const Column& column : columns_.find(runs, trunk_, sensor, reach)) {
    ++counters_.columns;
    if (const auto trunk = judge(cloud, runs, column, ground, level_covariance_rad2)) {
      detections.push_back(*trunk);
      ++counters_.trunks;
    }
  }
}

std::optional<Detection> SweepTrunks::judge(const RingCloud& cloud, const std::vector<Run>& runs,
                                            const Column& column, const GroundSurface& ground,
                                            const Eigen::Matrix2d& level_covariance_rad2) {
  const auto enough = [&](std::size_t points, std::size_t rings) {
    return points >= static_cast<std::size_t>(trunk_.min_points) &&
           rings >= static_cast<std::size_t>(trunk_.min_rings);
  };
  if (!enough(column.points, column.runs.size())) {
    ++counters_.too_few_points;
    return std::nullopt;
  }
  const auto fit = fitter_.fit(cloud, runs, column);
  if (!fit || !enough(fit->points, fit->rings)) {
    ++counters_.no_fit;
    return std::nullopt;
  }
  const GroundHeight below = ground.below(fit->state.head<2>());
  if (!plausible(*fit, below.height_m + sweep_.breast_height_m)) return std::nullopt;
  if (!stands(probe(cloud, *fit, below.height_m))) return std::nullopt;
  const Detection detection = to_detection(*fit, below, sweep_.breast_height_m,
                                           level_covariance_rad2, trunk_.shape_sigma_m);
  if (largest_sigma(detection.covariance_m2.topLeftCorner<2, 2>()) > trunk_.max_sigma_m) {
    ++counters_.uncertain;
    return std::nullopt;
  }
  const double range =
      (detection.position_m.head<2>() - cloud.sensor_m().head<2>().cast<double>()).norm();
  if (range > sweep_.max_range_m) {
    ++counters_.out_of_range;
    return std::nullopt;
  }
  return detection;
}

bool SweepTrunks::plausible(const StemFit& fit, double breast_z) {
  const double radius = fit.radius_at(breast_z);
  const double radius_sigma = std::sqrt(fit.covariance(2, 2));
  // Thin is what is thin beyond doubt.
  if (radius + radius_sigma < trunk_.min_radius_m || radius > trunk_.max_radius_m) {
    ++counters_.wrong_radius;
    return false;
  }
  if (fit.state.segment<2>(3).norm() > trunk_.max_lean_rad) {
    ++counters_.leaning;
    return false;
  }
  if (fit.mean_square_residual > trunk_.max_mean_square_residual) {
    ++counters_.not_round;
    return false;
  }
  return true;
}

StemProbe SweepTrunks::probe(const RingCloud& cloud, const StemFit& fit, double ground_z) const {
  StemProbe result;
  double lowest_on = std::numeric_limits<double>::infinity();
  double highest_on = -lowest_on;
  double lowest_through = lowest_on;
  double highest_through = highest_on;
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    const Look seen = look(cloud, ring, fit, sweep_.clearance_m);
    const bool in_zone =
        seen.z_m > ground_z + kFoot_m && seen.z_m < ground_z + sweep_.standing_height_m;
    const bool in_span = seen.z_m >= fit.low_z_m && seen.z_m <= fit.high_z_m;
    if (seen.met == Met::kUnknown || !(in_zone || in_span)) continue;
    if (seen.met == Met::kBeside) ++result.beside;
    if (seen.met == Met::kOn) {
      ++result.on;
      lowest_on = std::min(lowest_on, seen.z_m);
      highest_on = std::max(highest_on, seen.z_m);
    }
    if (seen.met == Met::kThrough) {
      ++result.through;
      lowest_through = std::min(lowest_through, seen.z_m);
      highest_through = std::max(highest_through, seen.z_m);
    }
  }
  result.open_above = highest_through > highest_on;
  result.open_below = lowest_through < lowest_on;
  return result;
}

bool SweepTrunks::stands(const StemProbe& probe) {
  if (probe.open_above || probe.open_below || 4 * probe.through > probe.on) {
    ++counters_.not_standing;
    return false;
  }
  if (probe.beside > probe.on) {
    ++counters_.in_leaves;
    return false;
  }
  return true;
}

}  // namespace understory
