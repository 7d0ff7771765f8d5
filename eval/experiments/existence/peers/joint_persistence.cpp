#include "eval/experiments/existence/peers/joint_persistence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::eval::experiments::existence::peers {
namespace {

constexpr int kSweeps = 30;

}  // namespace

std::vector<std::vector<std::uint32_t>> neighbours_of(const std::vector<Eigen::Vector3f>& points_m,
                                                      std::size_t count, float within_m) {
  std::vector<std::vector<std::uint32_t>> neighbours(points_m.size());
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    std::vector<std::pair<float, std::uint32_t>> near;
    for (std::uint32_t j = 0; j < points_m.size(); ++j) {
      const float distance_m = (points_m[j] - points_m[i]).norm();
      if (j != i && distance_m < within_m) near.emplace_back(distance_m, j);
    }
    std::sort(near.begin(), near.end());
    near.resize(std::min(near.size(), count));
    for (const auto& one : near) neighbours[i].push_back(one.second);
  }
  return neighbours;
}

std::vector<double> joint_beliefs(const std::vector<double>& own,
                                  const std::vector<std::vector<std::uint32_t>>& neighbours,
                                  double coupling) {
  std::vector<double> beliefs = own;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      const double p = std::clamp(own[i], 1e-12, 1.0 - 1e-12);
      double log_odds = std::log(p / (1.0 - p));
      for (const std::uint32_t j : neighbours[i]) log_odds += coupling * (2.0 * beliefs[j] - 1.0);
      beliefs[i] = 1.0 / (1.0 + std::exp(-log_odds));
    }
  }
  return beliefs;
}

}  // namespace understory::eval::experiments::existence::peers
