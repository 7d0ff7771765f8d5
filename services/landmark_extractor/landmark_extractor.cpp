#include "services/landmark_extractor/landmark_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "services/landmark_extractor/planar/segments.hpp"
#include "services/landmark_extractor/planar/trunk_fit.hpp"
#include "services/landmark_extractor/view/view_profile.hpp"

namespace understory::landmark_extractor {
namespace {

/// Sigma of a trunk's height against the sensor's plane [m]: a planar laser does not measure it.
constexpr double kHeightSigma_m = 0.5;
/// How far one sees is told so far beyond the range of trunks [m].
constexpr double kBeyond_m = 2.0;

bool well_formed(const model::PlanarScan& scan) {
  const double width = scan.bearing_step_rad *
                       static_cast<double>(scan.ranges_m.empty() ? 0 : scan.ranges_m.size() - 1);
  return scan.ranges_m.size() > 1 && std::isfinite(scan.first_bearing_rad) &&
         scan.bearing_step_rad > 0.0 && width < 2.0 * std::numbers::pi + 1e-6 &&
         scan.max_range_m > 0.0;
}

model::FieldOfView field_of_view(const model::PlanarScan& scan,
                                 const PlanarTrunkParameters& parameters) {
  model::FieldOfView view;
  view.max_range_m = std::min(scan.max_range_m, parameters.max_range_m);
  view.width_rad = scan.bearing_step_rad * static_cast<double>(scan.ranges_m.size() - 1);
  view.bearing_rad = geometry::wrap_angle(scan.first_bearing_rad + 0.5 * view.width_rad +
                                          parameters.vehicle_T_sensor.theta());
  return view;
}

/// Whether the borders let the object be one that stands alone; at most one side may be hidden.
bool stands_alone(const planar::Segment& segment) {
  const auto seen = [](planar::Border border) { return border == planar::Border::kClear; };
  const auto hidden = [](planar::Border border) { return border == planar::Border::kOccluded; };
  return (seen(segment.left) && (seen(segment.right) || hidden(segment.right))) ||
         (seen(segment.right) && hidden(segment.left));
}

model::Detection to_detection(const planar::TrunkFit& fit,
                              const PlanarTrunkParameters& parameters) {
  const geometry::SE2& vehicle_T_sensor = parameters.vehicle_T_sensor;
  const Eigen::Matrix2d rotation = vehicle_T_sensor.rotation();
  model::Detection detection;
  detection.position_m.head<2>() = vehicle_T_sensor * fit.centre();
  detection.covariance_m2.topLeftCorner<2, 2>() =
      rotation * fit.centre_covariance() * rotation.transpose() +
      parameters.shape_correlation_scans * parameters.shape_sigma_m * parameters.shape_sigma_m *
          Eigen::Matrix2d::Identity();
  detection.covariance_m2(2, 2) = kHeightSigma_m * kHeightSigma_m;
  detection.radius_m = fit.radius_m;
  detection.kind = model::LandmarkKind::kTrunk;
  return detection;
}

bool apart_from_others(const model::PlanarScan& scan, const std::vector<planar::Segment>& segments,
                       std::size_t index, const PlanarTrunkParameters& parameters) {
  return stands_alone(segments[index]) &&
         !continues_a_line(scan, segments[index], parameters.line_tolerance_m) &&
         nearest_object(scan, segments, index, parameters.separation_m) > parameters.separation_m;
}

/// A single beam leaves a radius of nothing possible: thin is what is thin beyond doubt.
bool trunk_sized(const planar::TrunkFit& fit, const PlanarTrunkParameters& parameters) {
  const double sigma = std::sqrt(fit.covariance(2, 2));
  return fit.radius_m + 2.0 * sigma >= parameters.min_radius_m &&
         fit.radius_m <= parameters.max_radius_m;
}

std::optional<model::Detection> to_trunk(const model::PlanarScan& scan,
                                         const std::vector<planar::Segment>& segments,
                                         std::size_t index, const PlanarTrunkParameters& parameters,
                                         ExtractorCounters& counters) {
  const planar::Segment& segment = segments[index];
  // Enough of it, and nothing beside it?
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
  ++counters_.scans;
  view_ = {};
  if (!well_formed(scan)) {
    ++counters_.scans_malformed;
    return result;
  }

  result.field_of_view = field_of_view(scan, parameters_.planar);
  view_ = view::planar_view(scan, parameters_.planar.vehicle_T_sensor,
                            parameters_.planar.max_range_m + kBeyond_m);
  const std::vector<planar::Segment> segments = planar::split(scan, parameters_.planar);
  counters_.objects += segments.size();

  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (const auto trunk = to_trunk(scan, segments, i, parameters_.planar, counters_)) {
      result.detections.push_back(*trunk);
    }
  }
  counters_.landmarks += result.detections.size();
  return result;
}

model::LandmarkScan LandmarkExtractor::extract(const model::PointSweep& sweep) {
  model::LandmarkScan result = sweeps_.extract(sweep);
  view_ = sweeps_.view();
  return result;
}

}  // namespace understory::landmark_extractor
