#include "common/place_recognition/stem_triangles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::place_recognition {
namespace {

/// Largest value of a corner's index.
constexpr std::size_t kMostStems = 65535;
/// Probability that two neighbours within the longest side are also within it of each other (in a
/// disc, by integration: 0.587).
constexpr double kNearEachOther = 0.587;

double longest_side_m(std::span<const LevelStem> stems, const StemTriangleParameters& parameters) {
  const double density = std::max(extent_of(stems).density_per_m2, 1e-6);
  // n stems with k neighbours each have n k^2 / 2 * 0.587 / 3 triangles.
  const double neighbours =
      std::sqrt(6.0 * parameters.triangles / kNearEachOther / static_cast<double>(stems.size()));
  return std::min(parameters.longest_m, std::sqrt(neighbours / (std::numbers::pi * density)));
}

/// At most `most` neighbours with a higher index, nearest first.
std::vector<std::uint16_t> later_neighbours(std::span<const LevelStem> stems, std::size_t own,
                                            double longest_m, std::size_t most) {
  std::vector<std::pair<double, std::uint16_t>> near;
  for (std::size_t i = own + 1; i < stems.size(); ++i) {
    const double squared = (stems[i].position_m - stems[own].position_m).squaredNorm();
    if (squared <= longest_m * longest_m) near.emplace_back(squared, static_cast<std::uint16_t>(i));
  }
  std::ranges::sort(near);
  near.resize(std::min(near.size(), most));

  std::vector<std::uint16_t> result;
  result.reserve(near.size());
  for (const auto& [squared, index] : near) result.push_back(index);
  return result;
}

StemTriangle ordered(std::span<const LevelStem> stems, std::array<std::uint16_t, 3> corner) {
  const auto side = [&](std::size_t opposite) {
    return (stems[corner[(opposite + 1) % 3]].position_m -
            stems[corner[(opposite + 2) % 3]].position_m)
        .norm();
  };
  std::array<std::pair<double, std::uint16_t>, 3> by_side{
      std::pair{-side(0), corner[0]}, {-side(1), corner[1]}, {-side(2), corner[2]}};
  std::ranges::sort(by_side);

  StemTriangle triangle;
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.side_m[i] = static_cast<float>(-by_side[i].first);
    triangle.corner[i] = by_side[i].second;
  }
  const Eigen::Vector2d& a = stems[triangle.corner[0]].position_m;
  const Eigen::Vector2d u = stems[triangle.corner[1]].position_m - a;
  const Eigen::Vector2d v = stems[triangle.corner[2]].position_m - a;
  triangle.is_left = u.x() * v.y() - u.y() * v.x() > 0.0;
  return triangle;
}

double height_m(std::span<const LevelStem> stems, const StemTriangle& triangle) {
  const Eigen::Vector2d& a = stems[triangle.corner[0]].position_m;
  const Eigen::Vector2d u = stems[triangle.corner[1]].position_m - a;
  const Eigen::Vector2d v = stems[triangle.corner[2]].position_m - a;
  return std::abs(u.x() * v.y() - u.y() * v.x()) / std::max(1e-6F, triangle.side_m[0]);
}

}  // namespace

std::vector<StemTriangle> stem_triangles(std::span<const LevelStem> stems,
                                         const StemTriangleParameters& parameters) {
  std::vector<StemTriangle> triangles;
  stems = stems.first(std::min<std::size_t>(stems.size(), kMostStems));
  if (stems.size() < 3) return triangles;
  const double longest_m = longest_side_m(stems, parameters);

  for (std::size_t i = 0; i + 2 < stems.size(); ++i) {
    const auto near = later_neighbours(stems, i, longest_m, parameters.most_neighbours);
    for (std::size_t a = 0; a < near.size(); ++a) {
      for (std::size_t b = a + 1; b < near.size(); ++b) {
        const double across = (stems[near[a]].position_m - stems[near[b]].position_m).norm();
        if (across > longest_m) continue;
        const StemTriangle triangle =
            ordered(stems, {static_cast<std::uint16_t>(i), near[a], near[b]});
        if (height_m(stems, triangle) >= parameters.least_height_m) triangles.push_back(triangle);
      }
    }
  }
  return triangles;
}

}  // namespace understory::place_recognition
