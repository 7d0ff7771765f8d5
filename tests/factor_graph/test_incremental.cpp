// The incremental smoother beyond what the mapper uses: space, removal, marginalisation, undo.
#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

#include <Eigen/Dense>
#include <map>
#include <memory>
#include <random>

#include "common/factor_graph/batch/batch.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/graph_copy.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using namespace understory::test;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double normal() { return normal_(engine_); }
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
  template <int size>
  Eigen::Matrix<double, size, 1> vector(double scale) {
    Eigen::Matrix<double, size, 1> v;
    for (int i = 0; i < size; ++i) v[i] = scale * normal();
    return v;
  }
  template <int size>
  Eigen::Matrix<double, size, size> information(double scale) {
    Eigen::Matrix<double, size, size> root;
    for (int i = 0; i < root.size(); ++i) root(i) = 0.2 * normal();
    root.diagonal().array() += 1.0;
    return scale * root.transpose() * root;
  }
  Pose3 pose3(double length, double angle) {
    const Eigen::Vector3d t = vector<3>(length);
    return {t, exp_rotation(vector<3>(angle))};
  }
  geometry::SE2 pose2(double length, double angle) {
    const Eigen::Vector2d t = vector<2>(length);
    return {t, angle * normal()};
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

factor_graph::bayes_tree::IncrementalParameters exact() {
  factor_graph::bayes_tree::IncrementalParameters parameters;
  parameters.least_move = 0.0;
  parameters.relinearise_above = 0.0;
  parameters.max_iterations = 1;
  return parameters;
}

double distance(const FactorGraph& graph, int v, const FactorGraph& other, VariableId w) {
  const Value& a = graph.value(VariableId(v));
  const Value& b = other.value(w);
  double largest = 0.0;
  const bool is_pose3 = graph.type(VariableId(v)) == VariableType::kPose3;
  const int numbers = is_pose3 ? 3 : dimension(graph.type(VariableId(v)));
  for (int i = 0; i < numbers; ++i) {
    const auto at = static_cast<std::size_t>(i);
    largest = std::max(largest, std::abs(a[at] - b[at]));
  }
  if (is_pose3) {
    largest = std::max(
        largest, log_rotation(pose3_of(a).rotation.conjugate() * pose3_of(b).rotation).norm());
  }
  return largest;
}

double distance_to_batch(const FactorGraph& graph) {
  test::GraphCopy copy(graph);
  factor_graph::batch::BatchParameters parameters;
  parameters.relative_decrease = 1e-15;
  REQUIRE(optimise(copy.graph, parameters).ok);
  double largest = 0.0;
  for (const auto& [v, w] : copy.names) {
    largest = std::max(largest, distance(graph, v, copy.graph, w));
  }
  return largest;
}

/// A walk in space with loops and a few points.
void grow(factor_graph::bayes_tree::IncrementalSmoother& smoother, std::vector<VariableId>& poses,
          Random& random) {
  const Matrix6 information = random.information<6>(400.0);
  if (poses.empty()) {
    poses.push_back(smoother.add_variable(random.pose3(0.1, 0.1)));
    smoother.add(prior(poses[0], Pose3{}, information));
    return;
  }
  const Pose3 step{{1.0, 0.2, 0.1}, exp_rotation({0.1, -0.05, 0.3})};
  const Pose3 noise = random.pose3(0.05, 0.05);
  const VariableId last = poses.back();
  poses.push_back(smoother.add_variable(smoother.pose3(last) * step * random.pose3(0.1, 0.1)));
  smoother.add(relative(last, poses.back(), step * noise, information));
  if (poses.size() > 4 && random.below(3) == 0) {
    const VariableId old =
        poses[static_cast<std::size_t>(random.below(static_cast<int>(poses.size()) - 2))];
    const Pose3 seen = smoother.pose3(old).inverse() * smoother.pose3(poses.back());
    smoother.add(relative(old, poses.back(), seen * random.pose3(0.05, 0.05), information));
  }
}

}  // namespace

TEST_CASE("In space the smoother ends where the batch solution is", "[incremental]") {
  Random random(1);
  for (int trial = 0; trial < 6; ++trial) {
    factor_graph::bayes_tree::IncrementalSmoother smoother(exact());
    std::vector<VariableId> poses;
    for (int k = 0; k < 25; ++k) {
      grow(smoother, poses, random);
      REQUIRE(smoother.update().ok);
    }
    for (int i = 0; i < 15; ++i) REQUIRE(smoother.update().ok);
    REQUIRE(distance_to_batch(smoother.graph()) < 1e-6);
  }
}

TEST_CASE("On a torus of noisy poses the steps do not swing for ever", "[incremental]") {
  Random random(5);
  constexpr int kAround = 12;
  constexpr int kPoses = 3 * kAround * kAround;
  std::vector<Pose3> truth;
  for (int k = 0; k < kPoses; ++k) {
    const double a = 2.0 * M_PI * k / kAround;
    const double b = 2.0 * M_PI * k / (kAround * kAround);
    const Eigen::Vector3d t((8.0 + 3.0 * std::cos(a)) * std::cos(b),
                            (8.0 + 3.0 * std::cos(a)) * std::sin(b), 3.0 * std::sin(a));
    const Eigen::Vector3d turn(0.0, 0.0, b);
    truth.emplace_back(Pose3{t, exp_rotation(turn) * exp_rotation(Eigen::Vector3d(0.0, -a, 0.0))});
  }
  const Matrix6 information =
      (Eigen::Matrix<double, 6, 1>() << 100, 100, 100, 25, 25, 25).finished().asDiagonal();
  const auto measured = [&](int i, int j) {
    const Pose3 between =
        truth[static_cast<std::size_t>(i)].inverse() * truth[static_cast<std::size_t>(j)];
    return between * random.pose3(0.2, 0.5);
  };
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  std::vector<VariableId> names;
  long relinearised = 0;
  for (int k = 0; k < kPoses; ++k) {
    if (k == 0) {
      names.push_back(smoother.add_variable(truth[0]));
      smoother.add(prior(names[0], truth[0], Matrix6(1e8 * Matrix6::Identity())));
    } else {
      const Pose3 step = measured(k - 1, k);
      names.push_back(smoother.add_variable(smoother.pose3(names.back()) * step));
      smoother.add(
          relative(names[static_cast<std::size_t>(k - 1)], names.back(), step, information));
    }
    for (const int back : {kAround, kAround * kAround}) {
      if (k < back) continue;
      const int other = k - back;
      smoother.add(relative(names[static_cast<std::size_t>(other)], names.back(),
                            measured(other, k), information));
    }
    const factor_graph::bayes_tree::IncrementalUpdate update = smoother.update();
    REQUIRE(update.ok);
    relinearised += update.relinearised_factors;
  }
  // Less than once each per update: half of the 3 kPoses factors are there in the mean.
  CHECK(relinearised < 3L * kPoses * kPoses / 2);
  const factor_graph::bayes_tree::IncrementalUpdate last = smoother.settle();
  CHECK(last.is_settled);
  test::GraphCopy copy(smoother.graph());
  REQUIRE(optimise(copy.graph, factor_graph::batch::BatchParameters{}).ok);
  CHECK(smoother.graph().chi2() < 1.001 * copy.graph.chi2());
}

TEST_CASE("Any sequence of adding, removing and undoing equals the batch solution of what remains",
          "[incremental]") {
  Random random(2);
  for (int trial = 0; trial < 12; ++trial) {
    factor_graph::bayes_tree::IncrementalSmoother smoother(exact());
    std::vector<VariableId> poses;
    for (int k = 0; k < 40; ++k) {
      const std::vector<VariableId> before = poses;
      std::map<int, Value> values;
      for (const VariableId id : poses) values[index(id)] = smoother.graph().value(id);
      const int choice = random.below(10);
      if (poses.size() < 4 || choice < 6) {
        grow(smoother, poses, random);
      } else if (choice < 8) {
        // The end of the chain goes, with what it saw.
        smoother.remove(poses.back());
        poses.pop_back();
      } else {
        const VariableId last = poses.back();
        smoother.add(position(last, Eigen::Vector3d(0.1, 0.2, 0.3),
                              Eigen::Vector3d(smoother.pose3(last).translation),
                              random.information<3>(10.0)));
      }
      REQUIRE(smoother.update().ok);
      if (random.below(4) == 0) {
        smoother.rollback();
        poses = before;
        for (const VariableId id : poses) {
          REQUIRE(smoother.graph().contains(id));
          REQUIRE(smoother.graph().value(id) == values.at(index(id)));
        }
      }
    }
    for (int i = 0; i < 20; ++i) REQUIRE(smoother.update().ok);
    REQUIRE(distance_to_batch(smoother.graph()) < 1e-6);
  }
}

TEST_CASE("Marginalising a variable of a linear graph leaves the others where they were",
          "[incremental]") {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    factor_graph::bayes_tree::IncrementalSmoother smoother(exact());
    std::vector<VariableId> points;
    for (int i = 0; i < 12; ++i) {
      points.push_back(smoother.add_variable(random.vector<3>(2.0)));
      smoother.add(prior(points.back(), random.vector<3>(2.0), random.information<3>(5.0)));
    }
    // A pose that is held fast ties points together linearly.
    const VariableId pose = smoother.add_variable(Pose3{});
    smoother.add(prior(pose, Pose3{}, Matrix6(1e3 * Matrix6::Identity())));
    for (const VariableId point : points) {
      smoother.add(observation(pose, point, random.vector<3>(1.0), random.information<3>(20.0)));
    }
    for (int i = 0; i < 30; ++i) REQUIRE(smoother.update().ok);
    const auto before = smoother.joint_covariance(std::vector<VariableId>{points[0], pose});
    const Eigen::Vector3d where = smoother.point3(points[0]);
    const std::vector<VariableId> gone{points[3], points[7]};
    REQUIRE(smoother.marginalise(gone));
    REQUIRE(smoother.update().ok);
    REQUIRE_FALSE(smoother.graph().contains(points[3]));
    const auto after = smoother.joint_covariance(std::vector<VariableId>{points[0], pose});
    REQUIRE((*after - *before).cwiseAbs().maxCoeff() < 1e-9);
    REQUIRE((smoother.point3(points[0]) - where).norm() < 1e-6);
  }
}

TEST_CASE("What a variable knew of its neighbour only by itself goes with it", "[incremental]") {
  // Exact in floating point: nothing at all is left for the neighbour.
  factor_graph::bayes_tree::IncrementalSmoother smoother(exact());
  const VariableId gone = smoother.add_variable(Eigen::Vector2d(0.0, 0.0));
  const VariableId pose = smoother.add_variable(geometry::SE2());
  const VariableId point = smoother.add_variable(Eigen::Vector2d(2.0, 1.0));
  smoother.add(prior(pose, geometry::SE2(), Eigen::Matrix3d(Eigen::Matrix3d::Identity())));
  smoother.add(observation(pose, point, Eigen::Vector2d(2.0, 1.0),
                           Eigen::Matrix2d(Eigen::Matrix2d::Identity())));
  const FactorId only = smoother.add(observation(pose, gone, Eigen::Vector2d(0.0, 0.0),
                                                 Eigen::Matrix2d(Eigen::Matrix2d::Identity())));
  REQUIRE(smoother.update().ok);
  const auto before = smoother.joint_covariance({&pose, 1});

  REQUIRE(smoother.marginalise({&gone, 1}));
  REQUIRE(smoother.update().ok);
  REQUIRE_FALSE(smoother.graph().contains(only));
  REQUIRE((smoother.point2(point) - Eigen::Vector2d(2.0, 1.0)).norm() < 1e-12);
  const auto after = smoother.joint_covariance({&pose, 1});
  REQUIRE(after);
  REQUIRE((*after - *before).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("With a fixed lag the graph stays small and the covariance what it would be",
          "[incremental]") {
  Random random(4);
  factor_graph::bayes_tree::IncrementalSmoother whole(exact());
  factor_graph::bayes_tree::IncrementalSmoother lagging(exact());
  std::vector<VariableId> all;
  std::vector<VariableId> window;
  const Eigen::Matrix3d information = 1e4 * Eigen::Matrix3d::Identity();
  for (int k = 0; k < 60; ++k) {
    const geometry::SE2 step(1.0, 0.1 * random.normal(), 0.1 * random.normal());
    for (auto* const part : {&whole, &lagging}) {
      auto& poses = part == &whole ? all : window;
      const geometry::SE2 at = poses.empty() ? geometry::SE2() : part->pose2(poses.back()) * step;
      poses.push_back(part->add_variable(at));
      if (poses.size() == 1) {
        part->add(prior(poses[0], geometry::SE2(), information));
      } else {
        part->add(relative(poses[poses.size() - 2], poses.back(), step, information));
      }
    }
    if (window.size() > 5) {
      REQUIRE(lagging.marginalise({window.data(), 1}));
      window.erase(window.begin());
    }
    REQUIRE(whole.update().ok);
    REQUIRE(lagging.update().ok);
    const auto expected = whole.joint_covariance({&all.back(), 1});
    const auto actual = lagging.joint_covariance({&window.back(), 1});
    REQUIRE((*expected - *actual).norm() < 1e-9);
  }
  REQUIRE(lagging.graph().variable_capacity() < 12);
  REQUIRE(lagging.graph().factor_capacity() < 24);
}

TEST_CASE("The three batch methods agree, also with the smoother, under a robust loss",
          "[incremental]") {
  Random random(5);
  factor_graph::bayes_tree::IncrementalParameters parameters = exact();
  factor_graph::bayes_tree::IncrementalSmoother smoother(parameters);
  std::vector<VariableId> poses;
  for (int k = 0; k < 20; ++k) {
    poses.push_back(
        smoother.add_variable(geometry::SE2(k, 0.1 * random.normal(), 0.05 * random.normal())));
    if (k == 0) {
      smoother.add(
          prior(poses[0], geometry::SE2(), Eigen::Matrix3d(1e4 * Eigen::Matrix3d::Identity())));
      continue;
    }
    smoother.add(relative(poses[static_cast<std::size_t>(k) - 1], poses.back(),
                          geometry::SE2(1, 0, 0), random.information<3>(100.0)));
    Factor gnss = position(poses.back(), Eigen::Vector2d(0.2, 0.1),
                           Eigen::Vector2d(k + (k == 7 ? 20.0 : 0.3 * random.normal()), 0.1),
                           random.information<2>(10.0));
    gnss.loss = {RobustKernel::kCauchy, 2.0};
    smoother.add(gnss);
    REQUIRE(smoother.update().ok);
  }
  for (int i = 0; i < 60; ++i) REQUIRE(smoother.update().ok);
  for (const factor_graph::batch::BatchMethod method :
       {factor_graph::batch::BatchMethod::kGaussNewton,
        factor_graph::batch::BatchMethod::kLevenbergMarquardt,
        factor_graph::batch::BatchMethod::kDogleg}) {
    test::GraphCopy copy(smoother.graph());
    for (const auto& [v, w] : copy.names) {
      Value value = copy.graph.value(w);
      value[1] += 0.05;
      copy.graph.set_value(index(w), value);
    }
    factor_graph::batch::BatchParameters how;
    how.method = method;
    how.relative_decrease = 1e-14;
    const factor_graph::batch::BatchReport report = optimise(copy.graph, how);
    REQUIRE(report.ok);
    REQUIRE(report.chi2 == Approx(smoother.graph().chi2()).epsilon(1e-6));
  }
}

TEST_CASE("A range and a bearing are those from the pose to the point", "[incremental]") {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> place(-20.0, 20.0);
  for (int trial = 0; trial < 50; ++trial) {
    const geometry::SE2 pose(place(random), place(random), place(random));
    const Eigen::Vector2d point(place(random), place(random));
    const Eigen::Vector2d seen = pose.inverse() * point;
    factor_graph::graph::FactorGraph graph;
    const VariableId a = graph.add(pose);
    const VariableId b = graph.add(point);
    const Eigen::Matrix2d information = Eigen::Vector2d(25.0, 1e4).asDiagonal();
    const double bearing_rad = std::atan2(seen.y(), seen.x());
    const auto exact = graph.add(range_bearing(a, b, seen.norm(), bearing_rad, information));
    const auto off =
        graph.add(range_bearing(a, b, seen.norm() + 0.4, bearing_rad - 0.02, information));
    CHECK(graph.chi2(exact) < 1e-15);
    CHECK(graph.chi2(off) == Approx(25.0 * 0.16 + 1e4 * 0.0004));
  }
}

TEST_CASE("A landmark observed once by its bearing is named", "[incremental]") {
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  const VariableId pose = smoother.add_variable(geometry::SE2());
  smoother.add(prior(pose, geometry::SE2(), Eigen::Matrix3d(Eigen::Matrix3d::Identity())));
  const VariableId seen = smoother.add_variable(Eigen::Vector2d(4.0, 1.0));
  const Eigen::Matrix2d bearing_only = Eigen::Vector2d(0.0, 100.0).asDiagonal();
  smoother.add(range_bearing(pose, seen, 4.0, 0.2, bearing_only));
  const factor_graph::bayes_tree::IncrementalUpdate update = smoother.update();
  REQUIRE_FALSE(update.ok);
  REQUIRE(update.undetermined == std::vector<VariableId>{seen});
  REQUIRE(update.error.find(factor_graph::bayes_tree::name_of(smoother.graph(), seen)) !=
          std::string::npos);
  REQUIRE(smoother.point2(seen).allFinite());
  REQUIRE_FALSE(smoother.joint_covariance({&seen, 1}));
  const Eigen::Matrix2d both = Eigen::Vector2d(25.0, 100.0).asDiagonal();
  smoother.add(range_bearing(pose, seen, 4.0, 0.2, both));
  REQUIRE(smoother.update().ok);
  REQUIRE(smoother.joint_covariance({&seen, 1}));
}
