#include "common/place_recognition/detectors/glare.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace understory::place_recognition::detectors {
namespace {

using Row = Eigen::Map<const Eigen::ArrayXf>;

/// Gaussians are cut off at this many standard deviations.
constexpr double kGaussianReach = 3.0;

/// The angle modulo pi, in [-pi/2, pi/2].
double line_angle(double angle_rad) { return std::remainder(angle_rad, std::numbers::pi); }

double gaussian(double offset, double sigma) {
  const double scaled = offset / sigma;
  return std::abs(scaled) > kGaussianReach ? 0.0 : std::exp(-0.5 * scaled * scaled);
}

/// L1 norm of a part of two rows.
double l1(std::span<const float> a, std::span<const float> b) {
  const auto size = static_cast<Eigen::Index>(a.size());
  return static_cast<double>((Row(a.data(), size) - Row(b.data(), size)).abs().sum());
}

}  // namespace

GlareSignature::GlareSignature(const GlareParameters& parameters, BearingInvariance invariance,
                               double place_sigma_m)
    : parameters_(parameters),
      invariance_(invariance),
      place_sigma_m_(place_sigma_m),
      bearing_step_rad_(std::numbers::pi / static_cast<double>(parameters.bearing_bins)) {}

void GlareSignature::add_pair(double range_m, double bearing_rad,
                              std::vector<double>& histogram) const {
  const double reach_m = kGaussianReach * parameters_.sigma_range_m;
  const double step_m = parameters_.range_step_m;
  const auto first =
      static_cast<std::size_t>(std::max(0.0, std::floor((range_m - reach_m) / step_m)));
  const auto last = std::min(parameters_.range_bins - 1,
                             static_cast<std::size_t>(std::floor((range_m + reach_m) / step_m)));

  for (std::size_t t = 0; t < parameters_.bearing_bins; ++t) {
    const double centre_rad = (static_cast<double>(t) + 0.5) * bearing_step_rad_;
    const double by_bearing =
        gaussian(line_angle(centre_rad - bearing_rad), parameters_.sigma_bearing_rad);
    if (by_bearing == 0.0) continue;
    for (std::size_t r = first; r <= last; ++r) {
      const double centre_m = (static_cast<double>(r) + 0.5) * step_m;
      histogram[t * parameters_.range_bins + r] +=
          by_bearing * gaussian(centre_m - range_m, parameters_.sigma_range_m);
    }
  }
}

bool GlareSignature::describe(const PlaceFrame& frame, std::span<float> row) const {
  const std::vector<LevelStem> landmarks = level_stems(frame);
  const double longest_m = static_cast<double>(parameters_.range_bins) * parameters_.range_step_m;
  std::vector<double> histogram(length(), 0.0);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    for (std::size_t j = i + 1; j < landmarks.size(); ++j) {
      const Eigen::Vector2d along = landmarks[j].position_m - landmarks[i].position_m;
      const double range_m = along.norm();
      if (range_m < longest_m) add_pair(range_m, std::atan2(along.y(), along.x()), histogram);
    }
  }

  const double sum = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  if (!(sum > 0.0)) return false;
  for (std::size_t i = 0; i < histogram.size(); ++i)
    row[i] = static_cast<float>(histogram[i] / sum);
  return true;
}

RowDistance GlareSignature::compare(std::span<const float> query,
                                    std::span<const float> frame) const {
  if (invariance_ == BearingInvariance::kNone) return {l1(query, frame), 0};

  // A row of the query is compared with the frame's row `shift` further, with wrap-around.
  RowDistance best{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t shift = 0; shift < parameters_.bearing_bins; ++shift) {
    const std::size_t turned = shift * parameters_.range_bins;
    const std::size_t straight = query.size() - turned;
    const double distance = l1(query.first(straight), frame.subspan(turned)) +
                            l1(query.subspan(straight), frame.first(turned));
    if (distance < best.distance) best = {distance, shift};
  }
  return best;
}

std::vector<geometry::SE2WithCovariance> GlareSignature::guesses(std::size_t shift) const {
  const double heading_rad = static_cast<double>(shift) * bearing_step_rad_;
  std::vector<geometry::SE2WithCovariance> found{
      heading_guess({0.0, 0.0, heading_rad}, place_sigma_m_, bearing_step_rad_)};
  if (invariance_ == BearingInvariance::kShifted) {
    found.push_back(heading_guess({0.0, 0.0, heading_rad + std::numbers::pi}, place_sigma_m_,
                                  bearing_step_rad_));
  }
  return found;
}

}  // namespace understory::place_recognition::detectors
