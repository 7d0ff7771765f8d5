// A simulated street grid has the stated noise, and the smoother solves it as well as a batch
// solver.
#include <algorithm>
#include <cmath>
#include <vector>

#include "eval/experiments/backend/backend.hpp"
#include "eval/experiments/backend/backend_world.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

eval::experiments::backend::WorldParameters small_world() {
  eval::experiments::backend::WorldParameters parameters;
  parameters.poses = 600;
  return parameters;
}

}  // namespace

TEST_CASE("a street grid has a motion for each step and closures of old places", "[backend]") {
  const factor_graph::files::GraphFile graph = make_world(small_world(), 3);
  REQUIRE(graph.vertices.size() == 600);

  int motions = 0;
  int closures = 0;
  for (const factor_graph::graph::Factor& factor : graph.factors) {
    const int a = index(factor.variables[0]);
    const int b = index(factor.variables[1]);
    REQUIRE(a < b);
    (b == a + 1 ? motions : closures) += 1;

    // A step is a metre, and a closure is at a place visited before.
    const double length = std::hypot(factor.measurement[0], factor.measurement[1]);
    CHECK(std::abs(length - (b == a + 1 ? 1.0 : 0.0)) < 0.5);
    CHECK((b == a + 1 || b - a > 20));
  }

  CHECK(motions == 599);
  CHECK(closures > 50);
}

TEST_CASE("the same seed gives the same streets", "[backend]") {
  const factor_graph::files::GraphFile one = make_world(small_world(), 5);
  const factor_graph::files::GraphFile two = make_world(small_world(), 5);
  REQUIRE(one.factors.size() == two.factors.size());
  for (std::size_t f = 0; f < one.factors.size(); ++f) {
    REQUIRE(one.factors[f].measurement == two.factors[f].measurement);
  }
  CHECK(make_world(small_world(), 6).factors[0].measurement != one.factors[0].measurement);
}

TEST_CASE("streets with precise odometry end at the batch optimum, as large as noise is",
          "[backend]") {
  eval::experiments::backend::WorldParameters parameters = small_world();
  parameters.motion_m = parameters.motion_rad = 0.002;
  parameters.closure_m = parameters.closure_rad = 0.1;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const factor_graph::files::GraphFile graph = make_world(parameters, seed);
    const eval::experiments::backend::BackendRun run =
        eval::experiments::backend::run_backend(graph, "streets");
    CHECK(run.error.empty());
    CHECK(run.chi2_final < 1.001 * run.chi2_batch);
    // Batch solvers of every moment converged, and independent starts end at the same optimum.
    for (const auto& moment : run.moments) {
      CHECK(moment.is_verified);
      CHECK(moment.chi2 > (1.0 - 1e-6) * moment.chi2_batch);
    }
    CHECK(run.moments.back().poses == static_cast<int>(run.poses));
    REQUIRE(run.chi2_chordal);
    CHECK(std::abs(*run.chi2_chordal / run.chi2_batch - 1.0) < 1e-6);
    CHECK(run.refactorisation_ms > 0.0);
    // chi^2 of 3 rows a factor less 3 a pose, the first of which is held fast.
    const double degrees =
        3.0 * (static_cast<double>(graph.factors.size()) - static_cast<double>(run.poses) + 1.0);
    CHECK(std::abs(run.chi2_final - degrees) < 5.0 * std::sqrt(2.0 * degrees));
  }
}

TEST_CASE("with the setting that ships the smoother is at every moment where the batch solver is",
          "[backend]") {
  std::vector<double> sigmas;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const eval::experiments::backend::BackendRun run =
        eval::experiments::backend::run_backend(make_world(small_world(), seed), "streets");
    for (const auto& moment : run.moments) {
      REQUIRE(moment.is_verified);
      // Of each moment, with the few residuals of its beginning as well.
      CHECK(moment.chi2 < 1.001 * moment.chi2_batch + 1e-2);
      sigmas.push_back(moment.newest.sigma);
      sigmas.insert(sigmas.end(), moment.seen_sigma.begin(), moment.seen_sigma.end());
    }
  }
  REQUIRE(sigmas.size() > 300);
  std::sort(sigmas.begin(), sigmas.end());
  CHECK(sigmas[sigmas.size() * 99 / 100] < 0.05);
}
