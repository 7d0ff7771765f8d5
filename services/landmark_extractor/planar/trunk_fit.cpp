#include "services/landmark_extractor/planar/trunk_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/geometry/se2.hpp"
#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::planar {
namespace {

constexpr int kIterations = 8;
/// Beams that graze the trunk beyond this share of the radius measure its range poorly.
constexpr double kMaxGraze = 0.9;

/// The returns of one object as seen from one position: the laser's at their middle. It moves by
/// about a centimetre while it scans a trunk.
struct Returns {
  std::vector<double> bearings_rad;
  std::vector<double> ranges_m;
  double step_rad = 0.0;
  bool is_right_seen = false;  ///< Its own edge.
  bool is_left_seen = false;
};

Returns returns_of(const Beams& scan, const Segment& segment, const Eigen::Vector2d& origin_m) {
  Returns result;
  result.step_rad = scan.step_rad;
  result.is_right_seen = segment.right == Border::kClear;
  result.is_left_seen = segment.left == Border::kClear;
  for (std::size_t i = segment.first; i <= segment.last; ++i) {
    const Beam& beam = scan.beams[i];
    const Eigen::Vector2d offset = beam.point_m - origin_m;
    const double turned = std::atan2(offset.y(), offset.x()) - beam.bearing_rad;
    result.bearings_rad.push_back(beam.bearing_rad + geometry::wrap_angle(turned));
    result.ranges_m.push_back(offset.norm());
  }
  return result;
}

/// Normal equations over (range, bearing, radius) of the centre.
struct Normal {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3d& jacobian, double residual, double sigma) {
    const double weight = 1.0 / square(sigma);
    information += weight * jacobian * jacobian.transpose();
    gradient += weight * residual * jacobian;
  }
};

struct RangeTerm {
  double predicted = 0.0;
  Eigen::Vector3d jacobian = Eigen::Vector3d::Zero();
  double sigma = 0.0;
};

/// Intersection of a beam at `bearing` with the circle x = (range, bearing, radius).
RangeTerm beam_on_circle(const Eigen::Vector3d& x, double bearing,
                         const PlanarTrunkParameters& parameters) {
  const double d = x[0];
  const double radius = x[2];
  const double c = std::cos(bearing - x[1]);
  const double sine = std::sin(bearing - x[1]);
  const double limit = kMaxGraze * radius / d;
  const double s = std::clamp(sine, -limit, limit);
  const double q = std::sqrt(square(radius) - square(d * s));
  RangeTerm term;
  term.predicted = d * c - q;
  const double per_bearing = d * s - square(d) * s * c / q;
  term.jacobian = {c + d * s * s / q, per_bearing, -radius / q};
  // The width of the footprint on a slanting surface blurs the range.
  term.sigma = std::sqrt(square(parameters.range_sigma_m) + square(parameters.roundness_sigma_m) +
                         square(per_bearing * parameters.beam_width_rad));
  // Nearer to the edge the range changes so steeply that only the edge itself is informative.
  if (std::abs(sine) > limit) term.sigma = std::hypot(term.sigma, radius);
  return term;
}

/// The edge on one side (+1 left, -1 right) lies between its last beam and the next.
void add_edge(const Eigen::Vector3d& x, double side, double last_bearing, double step,
              const PlanarTrunkParameters& parameters, Normal& normal) {
  const double seen = last_bearing + side * (0.5 * step - parameters.beam_width_rad);
  const double tangent = std::sqrt(std::max(square(x[0]) - square(x[2]), 1e-6));
  const double predicted = x[1] + side * std::asin(std::min(1.0, x[2] / x[0]));
  const Eigen::Vector3d jacobian(-side * x[2] / (x[0] * tangent), 1.0, side / tangent);
  const double sigma = std::sqrt(square(step) / 12.0 + square(0.5 * parameters.beam_width_rad) +
                                 square(parameters.roundness_sigma_m / x[0]));
  normal.add(jacobian, seen - predicted, sigma);
}

Normal linearise(const Eigen::Vector3d& x, const Returns& seen,
                 const PlanarTrunkParameters& parameters) {
  Normal normal;
  for (std::size_t i = 0; i < seen.ranges_m.size(); ++i) {
    const RangeTerm term = beam_on_circle(x, seen.bearings_rad[i], parameters);
    normal.add(term.jacobian, seen.ranges_m[i] - term.predicted, term.sigma);
  }
  const double step = seen.step_rad;
  if (seen.is_right_seen) add_edge(x, -1.0, seen.bearings_rad.front(), step, parameters, normal);
  if (seen.is_left_seen) add_edge(x, 1.0, seen.bearings_rad.back(), step, parameters, normal);
  normal.add({0.0, 0.0, 1.0}, parameters.prior_radius_m - x[2], parameters.prior_radius_sigma_m);
  return normal;
}

Eigen::Vector3d start(const Returns& seen, const PlanarTrunkParameters& parameters) {
  const double nearest = *std::ranges::min_element(seen.ranges_m);
  const double width = static_cast<double>(seen.ranges_m.size()) * seen.step_rad;
  const double half = std::max(0.0, 0.5 * width - parameters.beam_width_rad);
  const double sine = std::min(0.9, std::sin(std::min(half, 1.5)));
  const double radius =
      std::clamp(nearest * sine / (1.0 - sine), parameters.min_radius_m, parameters.max_radius_m);
  const double bearing = 0.5 * (seen.bearings_rad.front() + seen.bearings_rad.back());
  return {nearest + radius, bearing, radius};
}

/// Includes the fit's uncertainty: the error of an edge is uniform within a step, not Gaussian,
/// which affects beams near the edge.
double mean_square_residual(const Eigen::Vector3d& x, const Eigen::Matrix3d& covariance,
                            const Returns& seen, const PlanarTrunkParameters& parameters) {
  double sum = 0.0;
  for (std::size_t i = 0; i < seen.ranges_m.size(); ++i) {
    const RangeTerm term = beam_on_circle(x, seen.bearings_rad[i], parameters);
    const double variance = square(term.sigma) + term.jacobian.dot(covariance * term.jacobian);
    sum += square(seen.ranges_m[i] - term.predicted) / variance;
  }
  return sum / static_cast<double>(seen.ranges_m.size());
}

}  // namespace

Eigen::Vector2d TrunkFit::centre() const {
  return origin_m + range_m * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
}

Eigen::Matrix2d TrunkFit::centre_covariance() const {
  Eigen::Matrix2d jacobian;
  const Eigen::Vector2d offset = centre() - origin_m;
  jacobian.col(0) = offset / range_m;
  jacobian.col(1) = geometry::perpendicular(offset);
  return jacobian * covariance.topLeftCorner<2, 2>() * jacobian.transpose();
}

std::optional<TrunkFit> fit_trunk(const Beams& scan, const Segment& segment,
                                  const PlanarTrunkParameters& parameters) {
  const Eigen::Vector2d origin_m = scan.beams[(segment.first + segment.last) / 2].origin_m;
  const Returns seen = returns_of(scan, segment, origin_m);
  Eigen::Vector3d x = start(seen, parameters);
  for (int i = 0; i < kIterations; ++i) {
    const Normal normal = linearise(x, seen, parameters);
    const Eigen::Vector3d change = normal.information.inverse() * normal.gradient;
    x += change;
    x[2] = std::clamp(x[2], 0.5 * parameters.min_radius_m, 2.0 * parameters.max_radius_m);
    if (!x.allFinite() || x[0] < 1.1 * x[2]) return std::nullopt;
    if (change.norm() < 1e-5) break;
  }
  TrunkFit fit;
  fit.origin_m = origin_m;
  fit.range_m = x[0];
  fit.bearing_rad = x[1];
  fit.radius_m = x[2];
  fit.covariance = linearise(x, seen, parameters).information.inverse();
  fit.mean_square_residual = mean_square_residual(x, fit.covariance, seen, parameters);
  return fit;
}

}  // namespace understory::landmark_extractor::planar
