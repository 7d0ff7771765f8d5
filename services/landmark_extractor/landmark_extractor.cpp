#include "services/landmark_extractor/landmark_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/geometry/se2.hpp"
#include "services/landmark_extractor/planar/segments.hpp"
#include "services/landmark_extractor/planar/trunk_fit.hpp"
#include "services/landmark_extractor/square.hpp"
#include "services/landmark_extractor/view/planar_view.hpp"

namespace understory::landmark_extractor {
namespace {

/// VIEW_RANGES extend this far beyond the range of trunks [m].
constexpr double kBeyond_m = 2.0;

bool well_formed(const model::PlanarScan& scan) {
  const double width = scan.bearing_step_rad *
                       static_cast<double>(scan.ranges_m.empty() ? 0 : scan.ranges_m.size() - 1);
  return scan.ranges_m.size() > 1 && std::isfinite(scan.first_bearing_rad) &&
         scan.bearing_step_rad > 0.0 && width < 2.0 * std::numbers::pi + 1e-6 &&
         scan.max_range_m > 0.0;
}

/// A sweep of one ring keeps its beams separate and states its frame.
bool is_of_one_plane(const model::PointSweep& sweep) {
  return sweep.rings == 1 && sweep.is_deskewed && sweep.sensor_position_m.allFinite() &&
         (!sweep.attitude || (std::abs(sweep.attitude->level_Q_vehicle.norm() - 1.0) < 1e-3 &&
                              sweep.attitude->covariance_rad2.allFinite()));
}

/// From the first beam to the last one; in a sweep, from the first return to the last.
model::FieldOfView field_of_view(const planar::Beams& scan,
                                 const PlanarTrunkParameters& parameters) {
  model::FieldOfView view;
  view.max_range_m = std::min(scan.max_range_m, parameters.max_range_m);
  view.width_rad =
      scan.beams.empty() ? 0.0 : scan.beams.back().bearing_rad - scan.beams.front().bearing_rad;
  if (!scan.beams.empty())
    view.bearing_rad = geometry::wrap_angle(scan.beams.front().bearing_rad + 0.5 * view.width_rad);
  return view;
}

/// Whether the borders allow an isolated object; at most one side may be hidden.
bool stands_alone(const planar::Segment& segment) {
  const auto seen = [](planar::Border border) { return border == planar::Border::kClear; };
  const auto hidden = [](planar::Border border) { return border == planar::Border::kOccluded; };
  return (seen(segment.left) && (seen(segment.right) || hidden(segment.right))) ||
         (seen(segment.right) && hidden(segment.left));
}

model::Detection to_detection(const planar::TrunkFit& fit,
                              const PlanarTrunkParameters& parameters) {
  model::Detection detection;
  detection.position_m.head<2>() = fit.centre();
  detection.covariance_m2.topLeftCorner<2, 2>() =
      fit.centre_covariance() + parameters.shape_correlation_scans * parameters.shape_sigma_m *
                                    parameters.shape_sigma_m * Eigen::Matrix2d::Identity();
  detection.covariance_m2(2, 2) = planar::kHeightSigma_m * planar::kHeightSigma_m;
  detection.radius_m = fit.radius_m;
  detection.kind = model::LandmarkKind::kTrunk;
  return detection;
}

/// A roll and pitch error displaces a point at height z by z (pitch, -roll).
Eigen::Matrix2d level_error(double z_m, const Eigen::Matrix2d& level_covariance_rad2) {
  Eigen::Matrix2d moved;
  moved << 0.0, z_m, -z_m, 0.0;
  return moved * level_covariance_rad2 * moved.transpose();
}

bool apart_from_others(const planar::Beams& scan, const std::vector<planar::Segment>& segments,
                       std::size_t index, const PlanarTrunkParameters& parameters) {
  return stands_alone(segments[index]) &&
         !continues_a_line(scan, segments[index], parameters.line_tolerance_m) &&
         nearest_object(scan, segments, index, parameters.separation_m) > parameters.separation_m;
}

/// A single beam does not exclude a radius of zero: a trunk is too thin only if that is certain.
bool trunk_sized(const planar::TrunkFit& fit, const PlanarTrunkParameters& parameters) {
  const double sigma = std::sqrt(fit.covariance(2, 2));
  return fit.radius_m + 2.0 * sigma >= parameters.min_radius_m &&
         fit.radius_m <= parameters.max_radius_m;
}

std::optional<model::Detection> to_trunk(const planar::Beams& scan,
                                         const std::vector<planar::Segment>& segments,
                                         std::size_t index, const PlanarTrunkParameters& parameters,
                                         ExtractorCounters& counters) {
  const planar::Segment& segment = segments[index];
  // Enough beams, and isolated?
  if (segment.size() < static_cast<std::size_t>(std::max(1, parameters.min_points))) {
    ++counters.too_few_points;
    return std::nullopt;
  }
  if (!apart_from_others(scan, segments, index, parameters)) {
    ++counters.not_alone;
    return std::nullopt;
  }

  // Round, of a trunk's size, within range?
  const auto fit = fit_trunk(scan, segment, parameters);
  if (!fit || !trunk_sized(*fit, parameters) ||
      fit->mean_square_residual > parameters.max_mean_square_residual) {
    ++counters.not_round;
    return std::nullopt;
  }
  if (fit->range_m < parameters.min_range_m || fit->range_m > parameters.max_range_m) {
    ++counters.out_of_range;
    return std::nullopt;
  }
  return to_detection(*fit, parameters);
}

}  // namespace

model::LandmarkScan LandmarkExtractor::extract(const model::PlanarScan& scan) {
  model::LandmarkScan result;
  result.utime = scan.utime;
  result.sequence = scan.sequence;
  view_ = {};
  if (!well_formed(scan)) {
    ++counters_.scans;
    ++counters_.scans_malformed;
    return result;
  }
  find(planar::beams_of(scan), {}, result);
  return result;
}

model::LandmarkScan LandmarkExtractor::extract(const model::PointSweep& sweep) {
  if (!is_of_one_plane(sweep)) {
    // sweeps_ counts malformed sweeps.
    model::LandmarkScan of_sweep = sweeps_.extract(sweep);
    view_ = sweeps_.view();
    return of_sweep;
  }
  view_ = {};
  model::LandmarkScan result;
  result.utime = sweep.utime;
  result.sequence = sweep.sequence;

  points::Spin spin;
  spin_fitter_.fit(sweep, sweep.max_range_m, spin);
  PlaneLevel level;
  level.landmark_z_m = parameters_.sweep.breast_height_m;
  level.covariance_rad2 = sweep.attitude
                              ? sweep.attitude->covariance_rad2
                              : Eigen::Matrix2d(square(parameters_.sweep.level_sigma_rad) *
                                                Eigen::Matrix2d::Identity());
  find(planar::beams_of(sweep, spin), level, result);
  return result;
}

void LandmarkExtractor::find(const planar::Beams& scan, const PlaneLevel& level,
                             model::LandmarkScan& result) {
  ++counters_.scans;
  view_ = view::planar_view(scan, parameters_.planar.max_range_m + kBeyond_m);
  view_.utime = result.utime;
  view_.sequence = result.sequence;
  result.field_of_view = field_of_view(scan, parameters_.planar);
  const std::vector<planar::Segment> segments = planar::split(scan, parameters_.planar);
  counters_.objects += segments.size();

  for (std::size_t i = 0; i < segments.size(); ++i) {
    auto trunk = to_trunk(scan, segments, i, parameters_.planar, counters_);
    if (!trunk) continue;
    trunk->position_m.z() = level.landmark_z_m;
    trunk->covariance_m2.topLeftCorner<2, 2>() +=
        level_error(scan.beams[segments[i].first].z_m, level.covariance_rad2);
    result.detections.push_back(*trunk);
  }
  counters_.landmarks += result.detections.size();
  corners_.find(scan, level.landmark_z_m, level.covariance_rad2, result.detections);
}

}  // namespace understory::landmark_extractor
