#include "common/constellation/hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::constellation {
namespace {

/// Half widths of the gates to try [sigmas].
constexpr std::array kGateWidths{3.0, 2.5, 2.0, 1.5, 1.1};

/// Chooses the gate that separates right from wrong poses best (Kullback-Leibler divergence): wide
/// where landmarks are far apart, narrow where they are dense.
void set_gate(TestPoint& test, double sigma_m, double density_per_m2,
              const LocaliseParameters& parameters) {
  double most = -1.0;
  for (const double width : kGateWidths) {
    const double gate_m = std::min(width * sigma_m, parameters.max_gate_m);
    const double wrong = 1.0 - std::exp(-density_per_m2 * std::numbers::pi * gate_m * gate_m);
    const double within = 1.0 - std::exp(-0.5 * gate_m * gate_m / (sigma_m * sigma_m));
    const double right = wrong + (1.0 - wrong) * parameters.expected_hit_ratio * within;
    const double hit = std::log(right / wrong);
    const double miss = std::log((1.0 - right) / (1.0 - wrong));
    const double divergence = right * hit + (1.0 - right) * miss;
    if (divergence <= most) continue;
    most = divergence;
    test.gate_m = gate_m;
    test.hit = hit;
    test.miss = miss;
  }
}

}  // namespace

TriangleQuery::TriangleQuery(const Triangle& triangle, const PreparedObservation& observation)
    : triangle(triangle) {
  for (const Slot vertex : triangle.vertex) centroid += observation.points[vertex].position / 3.0;
  for (std::size_t i = 0; i < 3; ++i) {
    about_centroid[i] = observation.points[triangle.vertex[i]].position - centroid;
  }
}

void TriangleQuery::add_tests(const PreparedObservation& observation,
                              const LocaliseParameters& parameters) {
  const auto& points = observation.points;
  std::vector<std::pair<double, std::uint32_t>> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto& vertex = triangle.vertex;
    if (i == vertex[0] || i == vertex[1] || i == vertex[2]) continue;
    order.emplace_back((points[i].position - centroid).squaredNorm(), i);
  }
  const std::size_t count = std::min(kTestPoints, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());

  double variance = 0.0;
  double lever = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    variance += points[triangle.vertex[i]].variance / 3.0;
    lever += about_centroid[i].squaredNorm();
  }
  tests.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto [squared, i] = order[k];
    tests[k].about_centroid = points[i].position - centroid;
    tests[k].point = i;
    const double gate_variance = points[i].variance + variance / 3.0 + variance * squared / lever;
    set_gate(tests[k], std::sqrt(gate_variance), observation.density_per_m2, parameters);
  }
}

UnitMotion TriangleQuery::motion_to(const std::array<Eigen::Vector2d, 3>& landmark_m) const {
  const Eigen::Vector2d centre = (landmark_m[0] + landmark_m[1] + landmark_m[2]) / 3.0;
  double dot = 0.0;
  double cross = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d& p = about_centroid[i];
    const Eigen::Vector2d m = landmark_m[i] - centre;
    dot += p.dot(m);
    cross += p.x() * m.y() - p.y() * m.x();
  }
  const double norm = std::sqrt(dot * dot + cross * cross);
  return {dot / norm, cross / norm, centre};
}

}  // namespace understory::constellation
