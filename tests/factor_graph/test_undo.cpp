// Undo: numbers that a rollback computes again are those that were given up, bit for bit.
#include <algorithm>
#include <random>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using factor_graph::bayes_tree::IncrementalParameters;
using factor_graph::bayes_tree::IncrementalSmoother;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace {

constexpr std::size_t kKeepsEverything = std::size_t{1} << 40U;

IncrementalParameters with_undo(std::size_t bytes) {
  IncrementalParameters parameters;
  parameters.undo_bytes = bytes;
  return parameters;
}

/// The same history for two smoothers: one keeps all numbers for undo, the other one none.
class Twins {
 public:
  explicit Twins(std::uint64_t seed)
      : keeps_(with_undo(kKeepsEverything)), computes_(with_undo(0)), engine_(seed) {
    both([](IncrementalSmoother& smoother) {
      smoother.add(prior(smoother.add_variable(Pose3{}), Pose3{}, Matrix6(Matrix6::Identity())));
    });
    poses_.push_back(VariableId(0));
    update();
  }

  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
  template <typename Change>
  void both(Change&& change) {
    change(keeps_);
    change(computes_);
  }

  void step() {
    const VariableId last = poses_.back();
    const Pose3 motion{{1.0, 0.2, 0.1}, exp_rotation(vector(0.3))};
    const Pose3 start = keeps_.pose3(last) * motion * Pose3{vector(0.1), exp_rotation(vector(0.1))};
    VariableId next{};
    both([&](IncrementalSmoother& smoother) {
      next = smoother.add_variable(start);
      smoother.add(relative(last, next, motion, Matrix6(100.0 * Matrix6::Identity())));
    });
    poses_.push_back(next);
  }
  void close_loop() {
    if (poses_.size() < 3) return;
    const VariableId a = poses_[static_cast<std::size_t>(below(static_cast<int>(poses_.size())))];
    if (a == poses_.back()) return;
    const Pose3 seen = keeps_.pose3(a).inverse() * keeps_.pose3(poses_.back()) *
                       Pose3{vector(0.05), exp_rotation(vector(0.05))};
    both([&](IncrementalSmoother& smoother) {
      smoother.add(relative(a, poses_.back(), seen, Matrix6(100.0 * Matrix6::Identity())));
    });
  }
  void change_something() {
    step();
    const int choice = below(4);
    if (choice == 0) close_loop();
    if (choice == 1 && poses_.size() > 9) {
      const VariableId gone = poses_[poses_.size() / 2];
      both([&](IncrementalSmoother& smoother) { smoother.marginalise({&gone, 1}); });
      poses_.erase(poses_.begin() + static_cast<std::ptrdiff_t>(poses_.size() / 2));
    }
  }

  void update() {
    both([](IncrementalSmoother& smoother) { REQUIRE(smoother.update().ok); });
  }
  void require_same() {
    for (const VariableId id : poses_)
      REQUIRE(keeps_.graph().value(id) == computes_.graph().value(id));
    for (int i = 0; i < 3; ++i) {
      const VariableId id =
          poses_[static_cast<std::size_t>(below(static_cast<int>(poses_.size())))];
      const auto a = keeps_.joint_covariance({&id, 1});
      const auto b = computes_.joint_covariance({&id, 1});
      REQUIRE(a.has_value() == b.has_value());
      if (a) REQUIRE((*a - *b).cwiseAbs().maxCoeff() == 0.0);
    }
  }

  std::vector<VariableId> poses_;

 private:
  Eigen::Vector3d vector(double scale) {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = scale * normal_(engine_);
    return v;
  }

  IncrementalSmoother keeps_;
  IncrementalSmoother computes_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace

TEST_CASE("What a rollback computes again is what was given up", "[undo]") {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Twins twins(seed);
    for (int k = 0; k < 60; ++k) {
      const std::vector<VariableId> before = twins.poses_;
      twins.change_something();
      twins.update();
      twins.require_same();
      if (twins.below(4) != 0) continue;
      twins.both([](IncrementalSmoother& smoother) { smoother.rollback(); });
      twins.poses_ = before;
      twins.require_same();
    }
  }
}

TEST_CASE("A checkpoint with changes that no update took in is restored as it was", "[undo]") {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Twins twins(seed);
    for (int k = 0; k < 30; ++k) {
      twins.change_something();
      if (twins.below(2) == 0) twins.update();
      const std::vector<VariableId> before = twins.poses_;
      twins.both([](IncrementalSmoother& smoother) { smoother.checkpoint(); });
      for (int i = twins.below(3); i >= 0; --i) {
        twins.change_something();
        twins.update();
      }
      if (twins.below(2) == 0) {
        twins.both([](IncrementalSmoother& smoother) { smoother.rollback(); });
        twins.poses_ = before;
        twins.require_same();
      }
      twins.update();
      twins.require_same();
    }
  }
}
