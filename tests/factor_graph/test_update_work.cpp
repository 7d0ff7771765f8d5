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

/// Work of a drive along a road whose points are seen from many poses, while far behind a stretch
/// of it is measured again now and then [flops].
double work_of_drive(bool is_expected) {
  constexpr int kPoses = 150;
  constexpr int kInView = 12;
  constexpr int kBehind = 30;
  constexpr int kStretch = 12;
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  std::vector<VariableId> poses;
  std::vector<VariableId> points;
  std::vector<std::vector<FactorId>> seen_from;
  double work = 0.0;
  for (int i = 0; i < kPoses; ++i) {
    poses.push_back(smoother.add_variable(geometry::SE2(i, 0.0, 0.0)));
    for (const double side : {-5.0, 5.0})
      points.push_back(smoother.add_variable(Eigen::Vector2d(i, side)));
    if (i == 0) smoother.add(prior(poses[0], geometry::SE2{}, Eigen::Matrix3d::Identity() * 1e6));
    const auto observe = [&](int from) {
      std::vector<FactorId> factors;
      for (int k = 2 * std::max(0, from - kInView); k < 2 * from + 2; ++k) {
        const Eigen::Vector2d seen(k / 2 - from, k % 2 == 0 ? -5.0 : 5.0);
        factors.push_back(smoother.add(observation(poses[static_cast<std::size_t>(from)],
                                                   points[static_cast<std::size_t>(k)], seen,
                                                   Eigen::Matrix2d::Identity())));
      }
      return factors;
    };
    seen_from.push_back(observe(i));
    if (i > 0)
      smoother.add(relative(poses[poses.size() - 2], poses.back(), geometry::SE2(1.0, 0.0, 0.0),
                            Eigen::Matrix3d::Identity()));
    for (int k = i - kBehind; i > kBehind && i % kStretch == 0 && k < i - kBehind + kStretch; ++k) {
      std::vector<FactorId>& factors = seen_from[static_cast<std::size_t>(k)];
      for (const FactorId factor : factors) smoother.remove(factor);
      factors = observe(k);
    }
    if (is_expected) smoother.expect_changes_at(poses.back());
    const factor_graph::bayes_tree::IncrementalUpdate update = smoother.update();
    CHECK(update.ok);
    work += update.flops;
  }
  return work;
}

}  // namespace

TEST_CASE("An update is less work where it is said what changes next", "[work]") {
  CHECK(work_of_drive(true) < 0.9 * work_of_drive(false));
}

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
