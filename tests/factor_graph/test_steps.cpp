// Steps that the linearisations promise more of than the loss gives.
#include <cmath>
#include <memory>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;

namespace {

/// f(x) of a point's first coordinate, whitened; the second stays where it is.
template <typename Function>
class CurvedFactor : public UserFactor {
 public:
  explicit CurvedFactor(Function function) : function_(function) {}
  int residual_dimension() const override { return 2; }
  void evaluate(std::span<const Value> values, double* residual, double* jacobian) const override {
    const auto [value, slope] = function_(values[0][0]);
    residual[0] = value;
    residual[1] = values[0][1];
    if (jacobian == nullptr) return;
    jacobian[0] = slope;
    jacobian[1] = jacobian[2] = 0.0;
    jacobian[3] = 1.0;
  }

 private:
  Function function_;
};

template <typename Function>
void add(factor_graph::bayes_tree::IncrementalSmoother& smoother, VariableId point,
         Function function) {
  smoother.add(std::make_shared<CurvedFactor<Function>>(function), std::span(&point, 1));
}

/// Updates; the loss must not become larger.
void update_downhill(factor_graph::bayes_tree::IncrementalSmoother& smoother) {
  const double before = smoother.graph().chi2();
  REQUIRE(smoother.update().ok);
  CHECK(smoother.graph().chi2() <= 1.001 * before + 1e-3);
}

}  // namespace

TEST_CASE("A step that overshoots is halved until the loss is smaller", "[incremental]") {
  // Newton's steps on this diverge from here.
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  const VariableId point = smoother.add_variable(Eigen::Vector2d(1.0, 0.5));
  add(smoother, point,
      [](double x) { return std::pair(10.0 * std::atan(5.0 * x), 50.0 / (1.0 + 25.0 * x * x)); });
  for (int i = 0; i < 20; ++i) update_downhill(smoother);
  CHECK(std::abs(smoother.point2(point).x()) < 3e-4);
}

TEST_CASE("Many factors, each hardly off its linearisation, do not push the estimate uphill",
          "[incremental]") {
  factor_graph::bayes_tree::IncrementalSmoother smoother;
  const VariableId point = smoother.add_variable(Eigen::Vector2d(0.0, 0.0));
  for (int i = 0; i < 400; ++i) {
    add(smoother, point, [](double x) { return std::pair(x + 25.0 * x * x, 1.0 + 50.0 * x); });
  }
  REQUIRE(smoother.update().ok);
  for (int i = 0; i < 12; ++i) {
    add(smoother, point, [](double x) { return std::pair(10.0 * (x - 0.08), 10.0); });
    update_downhill(smoother);
  }
  const double reached = smoother.graph().chi2();
  smoother.settle();
  CHECK(reached < 1.02 * smoother.graph().chi2());
}
