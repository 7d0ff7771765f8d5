#include "services/landmark_extractor/planar/trunk_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/geometry/se2.hpp"

#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::planar {
namespace {

constexpr int kIterations = 8;
/// Beams that graze the trunk more than this (part of the radius) say little of its range.
constexpr double kMaxGraze = 0.9;

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

/// Where a beam at `bearing` meets the circle x = (range, bearing, radius).
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
  // A footprint of some width on a slanting surface smears the range.
  term.sigma = std::sqrt(square(parameters.range_sigma_m) + square(parameters.roundness_sigma_m) +
                         square(per_bearing * parameters.beam_width_rad));
  // Nearer to the edge the range falls off so steeply that only the edge itself says something.
  if (std::abs(sine) > limit) term.sigma = std::hypot(term.sigma, radius);
  return term;
}

/// The edge on one side (+1 left, -1 right) lies somewhere between its last beam and the next.
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

Normal linearise(const Eigen::Vector3d& x, const model::PlanarScan& scan, const Segment& segment,
                 const PlanarTrunkParameters& parameters) {
  Normal normal;
  for (std::size_t beam = segment.first; beam <= segment.last; ++beam) {
    const RangeTerm term = beam_on_circle(x, scan.bearing(beam), parameters);
    normal.add(term.jacobian, scan.ranges_m[beam] - term.predicted, term.sigma);
  }
  const double step = scan.bearing_step_rad;
  if (segment.right == Border::kClear) {
    add_edge(x, -1.0, scan.bearing(segment.first), step, parameters, normal);
  }
  if (segment.left == Border::kClear) {
    add_edge(x, 1.0, scan.bearing(segment.last), step, parameters, normal);
  }
  normal.add({0.0, 0.0, 1.0}, parameters.prior_radius_m - x[2], parameters.prior_radius_sigma_m);
  return normal;
}

Eigen::Vector3d start(const model::PlanarScan& scan, const Segment& segment,
                      const PlanarTrunkParameters& parameters) {
  const auto* ranges = scan.ranges_m.data();
  const double nearest = *std::min_element(ranges + segment.first, ranges + segment.last + 1);
  const double width = static_cast<double>(segment.size()) * scan.bearing_step_rad;
  const double half = std::max(0.0, 0.5 * width - parameters.beam_width_rad);
  const double sine = std::min(0.9, std::sin(std::min(half, 1.5)));
  const double radius =
      std::clamp(nearest * sine / (1.0 - sine), parameters.min_radius_m, parameters.max_radius_m);
  const double bearing = 0.5 * (scan.bearing(segment.first) + scan.bearing(segment.last));
  return {nearest + radius, bearing, radius};
}

/// Against what the fit leaves uncertain, too: edges are uniform within a step, not Gaussian, and a
/// beam near one feels that.
double mean_square_residual(const Eigen::Vector3d& x, const Eigen::Matrix3d& covariance,
                            const model::PlanarScan& scan, const Segment& segment,
                            const PlanarTrunkParameters& parameters) {
  double sum = 0.0;
  for (std::size_t beam = segment.first; beam <= segment.last; ++beam) {
    const RangeTerm term = beam_on_circle(x, scan.bearing(beam), parameters);
    const double variance = square(term.sigma) + term.jacobian.dot(covariance * term.jacobian);
    sum += square(scan.ranges_m[beam] - term.predicted) / variance;
  }
  return sum / static_cast<double>(segment.size());
}

}  // namespace

Eigen::Vector2d TrunkFit::centre() const {
  return {range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad)};
}

Eigen::Matrix2d TrunkFit::centre_covariance() const {
  Eigen::Matrix2d jacobian;
  jacobian.col(0) = centre() / range_m;
  jacobian.col(1) = geometry::perpendicular(centre());
  return jacobian * covariance.topLeftCorner<2, 2>() * jacobian.transpose();
}

std::optional<TrunkFit> fit_trunk(const model::PlanarScan& scan, const Segment& segment,
                                  const PlanarTrunkParameters& parameters) {
  Eigen::Vector3d x = start(scan, segment, parameters);
  for (int i = 0; i < kIterations; ++i) {
    const Normal normal = linearise(x, scan, segment, parameters);
    const Eigen::Vector3d change = normal.information.inverse() * normal.gradient;
    x += change;
    x[2] = std::clamp(x[2], 0.5 * parameters.min_radius_m, 2.0 * parameters.max_radius_m);
    if (!x.allFinite() || x[0] < 1.1 * x[2]) return std::nullopt;
    if (change.norm() < 1e-5) break;
  }
  TrunkFit fit;
  fit.range_m = x[0];
  fit.bearing_rad = x[1];
  fit.radius_m = x[2];
  fit.covariance = linearise(x, scan, segment, parameters).information.inverse();
  fit.mean_square_residual = mean_square_residual(x, fit.covariance, scan, segment, parameters);
  return fit;
}

}  // namespace understory::landmark_extractor::planar
