// No update of the incremental smoother is much more work than one factorisation of the whole.
#include <algorithm>
#include <map>
#include <random>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/graph_copy.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using namespace understory::test;

namespace {

/// A walk along the streets of a grid, which notes every crossing that it comes back to.
class Walk {
 public:
  explicit Walk(std::uint64_t seed) : engine_(seed) {}

  void step(factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    if (poses_.empty()) {
      poses_.push_back(smoother.add_variable(geometry::SE2{}));
      smoother.add(prior(poses_[0], geometry::SE2{}, Eigen::Matrix3d::Identity() * 1e6));
      return;
    }
    const geometry::SE2 before = truth_;
    const int turn = std::uniform_int_distribution<int>(-1, 1)(engine_);
    const double heading = before.theta() + turn * 0.5 * M_PI;
    truth_ = geometry::SE2(
        before.translation() + Eigen::Vector2d(std::cos(heading), std::sin(heading)), heading);
    truth_ = inside(truth_);
    const geometry::SE2 seen = before.inverse() * truth_ * noise();
    poses_.push_back(smoother.add_variable(smoother.pose2(poses_.back()) * seen));
    smoother.add(relative(poses_[poses_.size() - 2], poses_.back(), seen, information()));
    const auto cell = std::pair(std::lround(truth_.x()), std::lround(truth_.y()));
    const auto old = seen_.find(cell);
    if (old != seen_.end() && std::bernoulli_distribution(0.1)(engine_)) {
      const auto& [id, pose] = old->second;
      smoother.add(relative(id, poses_.back(), pose.inverse() * truth_ * noise(), information()));
    }
    seen_.insert_or_assign(cell, std::pair(poses_.back(), truth_));
  }

 private:
  static Eigen::Matrix3d information() { return Eigen::Vector3d(100.0, 100.0, 400.0).asDiagonal(); }
  /// Turns back at the edge of the town.
  static geometry::SE2 inside(const geometry::SE2& pose) {
    constexpr double kHalf = 12.0;
    Eigen::Vector2d at = pose.translation();
    if (at.cwiseAbs().maxCoeff() <= kHalf) return pose;
    at = at.cwiseMin(kHalf).cwiseMax(-kHalf);
    return geometry::SE2(at, pose.theta() + M_PI);
  }
  geometry::SE2 noise() { return geometry::SE2(Eigen::Vector2d(0.1 * n(), 0.1 * n()), 0.05 * n()); }
  double n() { return normal_(engine_); }

  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  geometry::SE2 truth_;
  std::vector<VariableId> poses_;
  std::map<std::pair<long, long>, std::pair<VariableId, geometry::SE2>> seen_;
};

}  // namespace

TEST_CASE("An update is at most about one factorisation's work", "[work]") {
  for (const std::uint64_t seed : {1, 2}) {
    factor_graph::bayes_tree::IncrementalSmoother smoother;
    Walk walk(seed);
    double most_work = 0.0;
    for (int i = 0; i < 1600; ++i) {
      walk.step(smoother);
      const factor_graph::bayes_tree::IncrementalUpdate update = smoother.update();
      REQUIRE(update.ok);
      if (i < 800) continue;  // What is little work in absolute terms may be done at once.
      most_work = std::max(most_work, update.flops / smoother.tree().total_flops());
    }
    INFO(most_work << " of a factorisation");
    CHECK(most_work < 1.3);
    smoother.settle();
    test::GraphCopy whole(smoother.graph());
    REQUIRE(optimise(whole.graph, factor_graph::batch::BatchParameters{}).ok);
    CHECK(smoother.graph().chi2() < 1.001 * whole.graph.chi2());
  }
}
