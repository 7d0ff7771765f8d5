// The incremental smoother in space against dense algebra, and under long random use.
#include <Eigen/Dense>
#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace {

class Walk {
 public:
  explicit Walk(std::uint64_t seed) : engine_(seed) {
    poses.push_back(smoother.add_variable(Pose3{}));
    smoother.add(prior(poses[0], Pose3{}, Matrix6(1e4 * Matrix6::Identity())));
  }

  int below(std::size_t count) {
    return std::uniform_int_distribution<int>(0, static_cast<int>(count) - 1)(engine_);
  }
  Pose3 noise(double scale) {
    const Eigen::Vector3d t = vector(scale);
    return {t, exp_rotation(vector(scale))};
  }
  VariableId any() { return poses[static_cast<std::size_t>(below(poses.size()))]; }

  void step() {
    const Pose3 motion{{1.0, 0.2, 0.1}, exp_rotation({0.1, -0.05, 0.3})};
    const VariableId last = poses.back();
    poses.push_back(smoother.add_variable(smoother.pose3(last) * motion * noise(0.05)));
    smoother.add(relative(last, poses.back(), motion * noise(0.02), information_));
  }
  void close_loop() {
    const VariableId a = any();
    const VariableId b = any();
    if (a == b) return;
    const Pose3 seen = smoother.pose3(a).inverse() * smoother.pose3(b);
    loops.push_back(smoother.add(relative(a, b, seen * noise(0.02), information_)));
  }
  void fix_position() {
    const VariableId pose = any();
    smoother.add(position(pose, Eigen::Vector3d(0.1, 0.2, 0.3),
                          Eigen::Vector3d(smoother.pose3(pose).translation + vector(0.05)),
                          Eigen::Matrix3d(50.0 * Eigen::Matrix3d::Identity())));
  }
  void hold_first() {
    smoother.add(prior(poses[0], smoother.pose3(poses[0]), Matrix6(1e4 * Matrix6::Identity())));
  }
  void forget_dead_loops() {
    std::erase_if(loops, [&](FactorId id) { return !smoother.graph().contains(id); });
  }

  factor_graph::bayes_tree::IncrementalSmoother smoother;
  std::vector<VariableId> poses;
  std::vector<FactorId> loops;

 private:
  Eigen::Vector3d vector(double scale) {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = scale * normal_(engine_);
    return v;
  }

  Matrix6 information_ = 400.0 * Matrix6::Identity();
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// Inverse of the dense information at the estimates, with translations in the poses' own frames.
Eigen::MatrixXd dense_covariance(const FactorGraph& graph, const std::vector<VariableId>& poses) {
  const auto size = static_cast<Eigen::Index>(6 * poses.size());
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  const auto start = [&](int variable) {
    const auto found = std::find(poses.begin(), poses.end(), VariableId(variable));
    return 6 * static_cast<Eigen::Index>(found - poses.begin());
  };
  for (int f = 0; f < graph.factor_capacity(); ++f) {
    if (!graph.contains(FactorId(f))) continue;
    const FactorRecord& factor = graph.factor(f);
    const Eigen::Map<const Eigen::MatrixXd> jacobian(factor.linear, factor.rows, factor.columns);
    const auto variables = graph.variables_of(f);
    for (std::size_t a = 0; a < variables.size(); ++a) {
      for (std::size_t b = 0; b < variables.size(); ++b) {
        hessian.block<6, 6>(start(variables[a]), start(variables[b])) +=
            jacobian.middleCols<6>(6 * static_cast<Eigen::Index>(a)).transpose() *
            jacobian.middleCols<6>(6 * static_cast<Eigen::Index>(b));
      }
    }
  }
  Eigen::MatrixXd covariance = hessian.inverse();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Matrix3d turn =
        pose3_of(graph.value(poses[i])).rotation.conjugate().toRotationMatrix();
    const auto at = 6 * static_cast<Eigen::Index>(i);
    covariance.middleRows<3>(at) = (turn * covariance.middleRows<3>(at)).eval();
    covariance.middleCols<3>(at) = (covariance.middleCols<3>(at) * turn.transpose()).eval();
  }
  return covariance;
}

/// Long graphs now and then; short ones come across more in the same time.
std::size_t most_poses(long operation) { return operation / 1000 % 10 == 2 ? 40 : 8; }

long operations() {
  const char* asked = std::getenv("UNDERSTORY_OPERATIONS");
  return asked == nullptr ? 3000 : std::atol(asked);
}

}  // namespace

TEST_CASE("In space joint covariances equal the dense inverse", "[incremental]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Walk walk(seed);
    for (int k = 0; k < 30; ++k) {
      walk.step();
      if (k % 3 == 2) walk.close_loop();
      REQUIRE(walk.smoother.update().ok);
    }
    // Linearised at the estimates, with nothing in the charts.
    for (int i = 0; i < 5; ++i) REQUIRE(walk.smoother.update_everything().ok);
    const std::vector<VariableId> some{walk.poses[30], walk.poses[0], walk.poses[11]};
    const auto stated = walk.smoother.joint_covariance(some);
    REQUIRE(stated);
    const Eigen::MatrixXd all = dense_covariance(walk.smoother.graph(), walk.poses);
    const Eigen::Index at[] = {180, 0, 66};
    for (Eigen::Index a = 0; a < 3; ++a) {
      for (Eigen::Index b = 0; b < 3; ++b) {
        const Matrix6 off = stated->block<6, 6>(6 * a, 6 * b) - all.block<6, 6>(at[a], at[b]);
        REQUIRE(off.cwiseAbs().maxCoeff() < 1e-9);
      }
    }
  }
}

// UNDERSTORY_OPERATIONS=1000000 under the sanitizers is the long run.
TEST_CASE("Random use for long: every answer is finite or names what is undetermined",
          "[incremental]") {
  Walk walk(7);
  long undetermined = 0;
  for (long k = 0; k < operations(); ++k) {
    const auto poses = walk.poses;
    const auto loops = walk.loops;
    const int choice = walk.below(12);
    if (walk.poses.size() < 5 || choice < 4) {
      walk.step();
    } else if (choice < 6) {
      walk.close_loop();
    } else if (choice == 6) {
      walk.fix_position();
    } else if (choice == 7 && !walk.loops.empty()) {
      const auto at = static_cast<std::ptrdiff_t>(walk.below(walk.loops.size()));
      walk.smoother.remove(walk.loops[static_cast<std::size_t>(at)]);
      walk.loops.erase(walk.loops.begin() + at);
    } else if (choice == 8) {
      walk.smoother.remove(walk.poses.back());
      walk.poses.pop_back();
      walk.forget_dead_loops();
    } else if (choice == 9 || walk.poses.size() > most_poses(k)) {
      // The oldest go; their information stays.
      const std::size_t gone =
          std::max<std::size_t>(walk.poses.size(), most_poses(k) + 1) - most_poses(k);
      const auto end = walk.poses.begin() + static_cast<std::ptrdiff_t>(gone);
      REQUIRE(walk.smoother.marginalise(std::vector<VariableId>(walk.poses.begin(), end)));
      walk.poses.erase(walk.poses.begin(), end);
      walk.forget_dead_loops();
    }
    const factor_graph::bayes_tree::IncrementalUpdate update = walk.smoother.update();
    // With the newest pose goes all that ties it to others, what held them in space, too: two
    // positions may be left, which let the rest turn about the line between them.
    REQUIRE((update.ok || !update.undetermined.empty()));
    if (!update.ok || walk.below(8) == 0) {
      walk.smoother.rollback();
      walk.poses = poses;
      walk.loops = loops;
    }
    if (!update.ok) {
      ++undetermined;
      walk.hold_first();
      REQUIRE(walk.smoother.update().ok);
    }
    if (k % 16 == 0) {
      for (const VariableId id : walk.poses) {
        const Pose3 pose = walk.smoother.pose3(id);
        REQUIRE((pose.translation.allFinite() && pose.rotation.coeffs().allFinite()));
      }
      const std::vector<VariableId> two{walk.poses.front(), walk.poses.back()};
      const auto covariance = walk.smoother.joint_covariance(two);
      if (update.ok && covariance) REQUIRE(covariance->diagonal().minCoeff() >= 0.0);
    }
  }
  REQUIRE(undetermined < operations() / 50);
}
