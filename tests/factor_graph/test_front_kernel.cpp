// Each kernel against Eigen's dense factorisation.
#include "common/factor_graph/bayes_tree/front_kernel.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory;

namespace {

Eigen::MatrixXd random_front(std::mt19937_64& random, int size) {
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(
      size, 2 * size, [&](Eigen::Index, Eigen::Index) { return normal(random); });
  return root * root.transpose();
}

std::vector<factor_graph::bayes_tree::FrontKernel> kernels() {
  std::vector<factor_graph::bayes_tree::FrontKernel> all{
      factor_graph::bayes_tree::front_kernel_portable(), factor_graph::bayes_tree::front_kernel()};
#if defined(__x86_64__)
  if (factor_graph::bayes_tree::front_kernel_avx2().factorise != nullptr &&
      __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    all.push_back(factor_graph::bayes_tree::front_kernel_avx2());
  }
#endif
  return all;
}

}  // namespace

TEST_CASE("Fronts of any size come out as dense algebra has them", "[front_kernel]") {
  std::mt19937_64 random(3);
  for (const factor_graph::bayes_tree::FrontKernel& kernel : kernels()) {
    for (int size = 2; size < 150; size += size < 40 ? 1 : 13) {
      const int pivots = 1 + static_cast<int>(random() % static_cast<unsigned>(size - 1));
      const Eigen::MatrixXd whole = random_front(random, size);
      Eigen::MatrixXd front = whole.triangularView<Eigen::Lower>();
      // What is above the diagonal must not matter.
      front.triangularView<Eigen::StrictlyUpper>().setConstant(
          std::numeric_limits<double>::quiet_NaN());
      const std::vector<double> least(static_cast<std::size_t>(pivots), 1e-12);
      std::vector<int> left_out(static_cast<std::size_t>(pivots));
      REQUIRE(kernel.factorise(front.data(), size, pivots, least.data(), left_out.data()) == 0);

      const int rest = size - pivots;
      const Eigen::MatrixXd l = whole.topLeftCorner(pivots, pivots).llt().matrixL().toDenseMatrix();
      const Eigen::MatrixXd below =
          l.triangularView<Eigen::Lower>().solve(whole.topRightCorner(pivots, rest)).transpose();
      const Eigen::MatrixXd schur = whole.bottomRightCorner(rest, rest) - below * below.transpose();
      const double scale = whole.cwiseAbs().maxCoeff();
      const auto lower = [](const Eigen::MatrixXd& m) {
        return Eigen::MatrixXd(m.triangularView<Eigen::Lower>());
      };
      INFO("size " << size << ", pivots " << pivots);
      CHECK((lower(front.topLeftCorner(pivots, pivots)) - l).norm() < 1e-10 * scale);
      CHECK((front.bottomLeftCorner(rest, pivots) - below).norm() < 1e-10 * scale);
      CHECK((lower(front.bottomRightCorner(rest, rest)) - lower(schur)).norm() < 1e-10 * scale);

      Eigen::VectorXd step = Eigen::VectorXd::Constant(size, 0.5);
      kernel.back_substitute(front.data(), size, pivots, step.data());
      const Eigen::VectorXd right =
          front.row(size - 1).head(pivots).transpose() -
          below.topRows(rest - 1).transpose() * Eigen::VectorXd::Constant(rest - 1, 0.5);
      CHECK((l.transpose() * step.head(pivots) - right).norm() < 1e-9 * scale);
    }
  }
}

TEST_CASE("A pivot without information is left out and touches nothing", "[front_kernel]") {
  std::mt19937_64 random(4);
  for (const factor_graph::bayes_tree::FrontKernel& kernel : kernels()) {
    for (const int size : {9, 30, 100}) {
      Eigen::MatrixXd front = random_front(random, size);
      const int empty = size / 3;
      front.row(empty).setZero();
      front.col(empty).setZero();
      const int pivots = size / 2;
      const std::vector<double> least(static_cast<std::size_t>(pivots), 1e-9);
      std::vector<int> left_out(static_cast<std::size_t>(pivots));
      REQUIRE(kernel.factorise(front.data(), size, pivots, least.data(), left_out.data()) == 1);
      CHECK(left_out[0] == empty);
      CHECK(front(empty, empty) == 1.0);
      CHECK(front.col(empty).tail(size - empty - 1).isZero(0.0));
      CHECK(front.row(empty).head(empty).isZero(0.0));
    }
  }
}

TEST_CASE("A contribution lands where the runs say, in whatever order the parent has its rows",
          "[front_kernel]") {
  using factor_graph::bayes_tree::RowRun;
  // Rows of the child side by side: three, one, nine, twenty, the right-hand side.
  const std::vector<RowRun> runs{{0, 30, 3}, {3, 7, 1}, {4, 36, 9}, {13, 8, 20}, {33, 49, 1}};
  constexpr int kRest = 34;
  constexpr int kSize = 50;
  std::mt19937_64 random(5);
  const Eigen::MatrixXd child = random_front(random, kRest);
  std::vector<double> packed;
  for (int c = 0; c < kRest; ++c) {
    for (int r = c; r < kRest; ++r) packed.push_back(child(r, c));
  }

  const auto row_of = [&](int row) {
    for (const RowRun& run : runs) {
      if (row < run.from + run.length) return run.to + row - run.from;
    }
    return 0;
  };
  const Eigen::MatrixXd before = random_front(random, kSize);
  Eigen::MatrixXd expected = before;
  for (int c = 0; c < kRest; ++c) {
    for (int r = c; r < kRest; ++r) {
      const int a = row_of(r);
      const int b = row_of(c);
      expected(std::max(a, b), std::min(a, b)) += child(r, c);
    }
  }

  for (const factor_graph::bayes_tree::FrontKernel& kernel : kernels()) {
    Eigen::MatrixXd front = before;
    kernel.add_contribution(front.data(), kSize, packed.data(), kRest, runs.data(),
                            static_cast<int>(runs.size()));
    CHECK((front - expected).cwiseAbs().maxCoeff() == 0.0);
  }
}
