#include "services/landmark_extractor/trunks/sweep_trunks.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/decompositions.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

/// An object this wide must not fit an upright plane better.
constexpr double kFlatWidth_m = 0.2;
/// An object without returns above this height is a stone, a stump, a tuft of grass.
constexpr double kStump_m = 0.6;
/// Returns within this distance of the fitted surface are on it [sigma].
constexpr double kOnBark = 2.0;

/// Runs of at least this number of rings belong to a stem rather than a bush.
constexpr std::size_t kTall = 5;
/// Upper limit of the share of lost beams.
constexpr double kMostLost = 0.5;

/// Error of the centre of a stem that is not round. An oval that extends towards the sensor by some
/// length is narrower by the same length on either side; so the radius, and the distance of the
/// centre behind the front, are wrong by twice that. Three-cornered ones shift both edges to one
/// side.
Eigen::Matrix2d from_shape(const Eigen::Vector2d& from_sensor_m, double wave_m) {
  const Eigen::Vector2d ray = from_sensor_m.normalized();
  return wave_m * wave_m * (Eigen::Matrix2d::Identity() + 3.0 * ray * ray.transpose());
}

/// The centre at breast height with its covariance, without that of its shape.
model::Detection to_detection(const StemFit& fit, const ground::GroundHeight& ground,
                              double breast_height, const Eigen::Matrix2d& level_covariance_rad2) {
  const double z = ground.height_m + breast_height;
  const double above = z - fit.reference_z_m;
  Eigen::Matrix<double, 2, 6> jacobian = Eigen::Matrix<double, 2, 6>::Zero();
  jacobian(0, 0) = jacobian(1, 1) = 1.0;
  jacobian(0, 3) = jacobian(1, 4) = above;
  model::Detection detection;
  detection.kind = model::LandmarkKind::kTrunk;

  detection.position_m << fit.centre_at(z), z;
  detection.radius_m = fit.radius_at(z);

  Eigen::Vector3d along_axis;
  along_axis << fit.state.segment<2>(3), 1.0;
  detection.covariance_m2 = ground.sigma_m * ground.sigma_m * along_axis * along_axis.transpose() +
                            from_level_error(detection.position_m, level_covariance_rad2);
  detection.covariance_m2.topLeftCorner<2, 2>() += jacobian * fit.covariance * jacobian.transpose();
  return detection;
}

/// Probability that a beam without a return beside a run hit the same object and was lost. Such
/// beams can be counted between the points of runs; at the edges there are as many, among those
/// that passed by.
double share_of_lost(const std::vector<rings::Run>& runs, const std::vector<Column>& columns) {
  double met = 0.0;
  double lost = 0.0;
  double edges = 0.0;
  double silent = 0.0;
  const auto look = [&](planar::Border border, bool is_silent) {
    if (border != planar::Border::kClear) return;
    edges += 1.0;
    silent += is_silent ? 1.0 : 0.0;
  };

  for (const Column& column : columns) {
    if (column.runs.size() < kTall) continue;
    for (const std::uint32_t k : column.runs) {
      const rings::Run& run = runs[k];
      look(run.left, run.is_left_silent);
      look(run.right, run.is_right_silent);
      met += run.met;
      lost += run.lost;
    }
  }
  return lost > 0.0 && silent > 0.0 ? std::min(kMostLost, lost / met * edges / silent) : 0.0;
}

double largest_sigma(const Eigen::Matrix2d& covariance) {
  return std::sqrt(geometry::eigenvalues(covariance).maxCoeff());
}

}  // namespace

void SweepTrunks::find(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                       const ground::GroundSurface& ground,
                       const Eigen::Matrix2d& level_covariance_rad2,
                       std::vector<model::Detection>& detections) {
  const Eigen::Vector2f sensor = cloud.sensor_m().head<2>();
  const auto reach = static_cast<float>(sweep_.max_range_m) + 2.0F;
  const auto& columns = columns_.find(runs, trunk_, sensor, reach);
  fitter_.expect_lost(share_of_lost(runs, columns));
  for (const Column& column : columns) {
    ++counters_.columns;
    if (const auto trunk = judge(cloud, runs, column, ground, level_covariance_rad2)) {
      detections.push_back(*trunk);
      ++counters_.trunks;
    }
  }
}

std::optional<model::Detection> SweepTrunks::judge(const rings::RingCloud& cloud,
                                                   const std::vector<rings::Run>& runs,
                                                   const Column& column,
                                                   const ground::GroundSurface& ground,
                                                   const Eigen::Matrix2d& level_covariance_rad2) {
  // Enough points and rings?
  const auto enough = [&](std::size_t points, std::size_t rings) {
    return points >= static_cast<std::size_t>(trunk_.min_points) &&
           rings >= static_cast<std::size_t>(trunk_.min_rings);
  };
  if (!enough(column.points, column.runs.size())) {
    ++counters_.too_few_points;
    return std::nullopt;
  }

  // A stem?
  const auto fit = fitter_.fit(cloud, runs, column);
  if (!fit || !enough(fit->points, fit->rings)) {
    ++counters_.no_fit;
    return std::nullopt;
  }

  // A trunk's shape, above the ground, and not in leaves?
  const ground::GroundHeight below = ground.below(fit->state.head<2>());
  if (!plausible(*fit, below.height_m + sweep_.breast_height_m)) return std::nullopt;
  if (fit->high_z_m < below.height_m + kStump_m) {
    ++counters_.not_standing;
    return std::nullopt;
  }
  if (is_in_leaves(cloud, runs, *fit)) {
    ++counters_.in_leaves;
    return std::nullopt;
  }

  // Accurate enough, and within range?
  model::Detection detection =
      to_detection(*fit, below, sweep_.breast_height_m, level_covariance_rad2);
  const Eigen::Vector2d from_sensor =
      detection.position_m.head<2>() - cloud.sensor_m().head<2>().cast<double>();
  detection.covariance_m2.topLeftCorner<2, 2>() +=
      from_shape(from_sensor, trunk_.out_of_round * detection.radius_m);
  if (largest_sigma(detection.covariance_m2.topLeftCorner<2, 2>()) > trunk_.max_sigma_m) {
    ++counters_.uncertain;
    return std::nullopt;
  }
  const double range = from_sensor.norm();
  if (range > sweep_.max_range_m) {
    ++counters_.out_of_range;
    return std::nullopt;
  }

  // The most expensive check comes last.
  if (!is_tall(probe_stem(cloud, *fit, below.height_m, sweep_))) return std::nullopt;
  return detection;
}

/// Below a crown: whether more returns are beside the stem than a trunk has. A run that continues
/// along a branch has returns of both.
bool SweepTrunks::is_in_leaves(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                               const StemFit& fit) {
  columns_.runs_near(runs, fit.state.head<2>().cast<float>(),
                     static_cast<float>(trunk_.leaf_radius_m),
                     static_cast<float>(sweep_.standing_height_m), near_);
  const double bark = kOnBark * std::hypot(sweep_.range_sigma_m, trunk_.roundness_sigma_m);

  std::size_t on = 0;
  std::size_t around = 0;
  for (const std::uint32_t i : near_) {
    around += runs[i].size();
    for (std::uint32_t k = runs[i].first; k <= runs[i].last; ++k) {
      const points::RingPoint& point = cloud.points()[k];
      const Eigen::Vector2d place(point.x_m, point.y_m);
      const double from_axis = (place - fit.centre_at(point.z_m)).norm();
      if (std::abs(from_axis - fit.radius_at(point.z_m)) < bark) ++on;
    }
  }
  return static_cast<double>(on) < trunk_.min_share * static_cast<double>(around);
}

bool SweepTrunks::plausible(const StemFit& fit, double breast_z) {
  const double radius = fit.radius_at(breast_z);
  const double radius_sigma = std::sqrt(fit.covariance(2, 2));
  // Too thin only if that is certain.
  if (radius + 2.0 * radius_sigma < trunk_.min_radius_m || radius > trunk_.max_radius_m) {
    ++counters_.wrong_radius;
    return false;
  }
  if (fit.state.segment<2>(3).norm() > trunk_.max_lean_rad) {
    ++counters_.leaning;
    return false;
  }
  const bool is_flat = fit.width_m > kFlatWidth_m && fit.flat_excess < 0.0;
  if (is_flat || fit.mean_square_residual > trunk_.max_mean_square_residual) {
    ++counters_.not_round;
    return false;
  }
  return true;
}

bool SweepTrunks::is_tall(const StemProbe& probe) {
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

}  // namespace understory::landmark_extractor::trunks
