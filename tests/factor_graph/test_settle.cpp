// settle() ends at the optimum, whatever the measurements' last digits are.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "tests/catch.hpp"
#include "tests/factor_graph/graph_copy.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;

namespace {

constexpr double kSigma_m = 0.02;
constexpr double kSigma_rad = 0.05;
constexpr int kTownPoses = 350;
constexpr int kTownSide = 8;

/// A measured motion between two poses of a drive.
struct Tie {
  int a = 0, b = 0;
  geometry::SE2 a_T_b;
};

/// A drive through a town of crossings, which it recognises now and then when it comes back.
std::vector<Tie> drive(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> turn(-1, 1);
  std::vector<geometry::SE2> truth{{}};
  std::map<std::pair<long, long>, int> seen{{{0, 0}, 0}};
  std::vector<Tie> ties;

  const auto tie = [&](int a, int b) {
    const geometry::SE2 motion =
        truth[static_cast<std::size_t>(a)].inverse() * truth[static_cast<std::size_t>(b)];
    const double dx = kSigma_m * normal(random);
    const double dy = kSigma_m * normal(random);
    ties.push_back({a, b, motion * geometry::SE2(dx, dy, kSigma_rad * normal(random))});
  };

  for (int k = 1; k < kTownPoses; ++k) {
    geometry::SE2 next = truth.back() * geometry::SE2(0.0, 0.0, 0.5 * M_PI * turn(random));
    next = next * geometry::SE2(1.0, 0.0, 0.0);
    if (std::max(std::abs(next.x()), std::abs(next.y())) > kTownSide + 0.5) {
      next = truth.back() * geometry::SE2(0.0, 0.0, M_PI);
    }
    truth.push_back(next);
    tie(k - 1, k);
    const auto [place, is_new] = seen.insert({{std::lround(next.x()), std::lround(next.y())}, k});
    if (!is_new && k - place->second > 20 && random() % 30 == 0) tie(place->second, k);
  }
  return ties;
}

/// The drive's graph with noise added to its measurements, pose by pose through the smoother.
void run(factor_graph::bayes_tree::IncrementalSmoother& smoother, const std::vector<Tie>& ties,
         double noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Eigen::Matrix3d information =
      Eigen::Vector3d(1.0 / (kSigma_m * kSigma_m), 1.0 / (kSigma_m * kSigma_m),
                      1.0 / (kSigma_rad * kSigma_rad))
          .asDiagonal();
  std::vector<VariableId> names{smoother.add_variable(geometry::SE2{})};
  smoother.add(prior(names[0], geometry::SE2{}, 1e8 * Eigen::Matrix3d::Identity()));

  for (const Tie& tie : ties) {
    const double dx = noise * normal(random);
    const double dy = noise * normal(random);
    const geometry::SE2 a_T_b = tie.a_T_b * geometry::SE2(dx, dy, noise * normal(random));
    const VariableId a = names[static_cast<std::size_t>(tie.a)];
    if (tie.b == static_cast<int>(names.size())) {
      REQUIRE(smoother.update().ok);
      names.push_back(smoother.add_variable(smoother.pose2(a) * a_T_b));
    }
    smoother.add(relative(a, names[static_cast<std::size_t>(tie.b)], a_T_b, information));
  }
  REQUIRE(smoother.update().ok);
}

}  // namespace

TEST_CASE("Of hundreds of graphs that differ in the last digits, each settles at its optimum",
          "[incremental]") {
  std::mt19937_64 random(7);
  double most = 0.0;
  int missed = 0;
  for (int i = 0; i < 200; ++i) {
    const double noise = std::pow(10.0, -5.0 + 2.0 * i / 199.0);
    factor_graph::bayes_tree::IncrementalSmoother smoother;
    run(smoother, drive(static_cast<std::uint64_t>(i % 4)), noise, random);
    CHECK(smoother.settle().is_settled);

    test::GraphCopy whole(smoother.graph());
    factor_graph::batch::BatchParameters parameters;
    parameters.relative_decrease = 1e-10;
    REQUIRE(optimise(whole.graph, parameters).converged);
    const double excess = smoother.graph().chi2() / whole.graph.chi2() - 1.0;
    most = std::max(most, excess);
    if (excess > 1e-3) ++missed;
  }
  INFO("largest excess " << most);
  CHECK(missed == 0);
  CHECK(most < 1e-3);
}
