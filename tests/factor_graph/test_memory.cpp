// What the smoother takes from the system beside the numbers of its tree (bytes counted, not
// timed).
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/storage/block_pool.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;
using factor_graph::bayes_tree::CliqueRecord;
using factor_graph::bayes_tree::IncrementalParameters;
using factor_graph::bayes_tree::IncrementalSmoother;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

namespace {

constexpr int kAround = 14;

/// A pose of a spiral around a tube, with its ties to the last pose and to those one turn back.
class Spiral {
 public:
  void step(IncrementalSmoother& smoother) {
    const int k = static_cast<int>(names_.size());
    if (k == 0) {
      names_.push_back(smoother.add_variable(truth(0)));
      smoother.add(prior(names_[0], truth(0), Matrix6(1e6 * Matrix6::Identity())));
      return;
    }
    const Pose3 motion = measured(k - 1, k);
    names_.push_back(smoother.add_variable(smoother.pose3(names_.back()) * motion));
    tie(smoother, k - 1, motion);
    for (const int back : {kAround, kAround + 1}) {
      if (k >= back) tie(smoother, k - back, measured(k - back, k));
    }
  }

 private:
  static Pose3 truth(int k) {
    const double a = 2.0 * M_PI * k / kAround;
    const Eigen::Vector3d at(0.1 * k, 3.0 * std::cos(a), 3.0 * std::sin(a));
    return {at, exp_rotation(Eigen::Vector3d(a, 0.0, 0.0))};
  }
  Pose3 measured(int i, int j) {
    const Pose3 noise{vector(0.05), exp_rotation(vector(0.05))};
    return truth(i).inverse() * truth(j) * noise;
  }
  void tie(IncrementalSmoother& smoother, int from, const Pose3& seen) {
    smoother.add(relative(names_[static_cast<std::size_t>(from)], names_.back(), seen,
                          Matrix6(400.0 * Matrix6::Identity())));
  }
  Eigen::Vector3d vector(double scale) {
    Eigen::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = scale * normal_(engine_);
    return v;
  }

  std::vector<VariableId> names_;
  std::mt19937_64 engine_{3};
  std::normal_distribution<double> normal_;
};

/// Bytes of the numbers that the tree and the graph consist of, each once.
double needed_bytes(const IncrementalSmoother& smoother) {
  std::size_t numbers = 0;
  const auto& cliques = smoother.tree().cliques();
  for (int c = 1; c < cliques.capacity(); ++c) {
    const CliqueRecord& clique = cliques[c];
    if (clique.parent == kNone) continue;
    numbers += clique.panel_numbers();
    if (cliques.contributions().find(c) != nullptr) numbers += clique.contribution_numbers();
  }
  for (int f = 0; f < smoother.graph().factor_capacity(); ++f) {
    const FactorRecord& factor = smoother.graph().factor(f);
    numbers += static_cast<std::size_t>(factor.rows * (factor.columns + 1) + factor.data_size);
  }
  return static_cast<double>(numbers * sizeof(double));
}

/// Part of the contributions that is there, of all that cliques hand to their parents.
double kept_part(const IncrementalSmoother& smoother) {
  double all = 0.0;
  double kept = 0.0;
  const auto& cliques = smoother.tree().cliques();
  for (int c = 1; c < cliques.capacity(); ++c) {
    if (cliques[c].parent <= 0) continue;
    const auto numbers = static_cast<double>(cliques[c].contribution_numbers());
    all += numbers;
    if (cliques.contributions().find(c) != nullptr) kept += numbers;
  }
  return kept / all;
}

/// Of the memory at its largest, what the numbers in use at that moment do not explain.
double most_beside(std::size_t undo_bytes) {
  IncrementalParameters parameters;
  parameters.undo_bytes = undo_bytes;
  IncrementalSmoother smoother(parameters);
  Spiral spiral;
  double most = 0.0;
  for (int k = 0; k < 500; ++k) {
    spiral.step(smoother);
    REQUIRE(smoother.update().ok);
    most = std::max(most, static_cast<double>(smoother.bytes()) - 1.2 * needed_bytes(smoother));
  }
  CHECK(kept_part(smoother) < 0.9);
  return most;
}

}  // namespace

TEST_CASE("The smoother holds the numbers of its tree once, and what undo may have", "[memory]") {
  constexpr double kChunks = 4.0 * 65536.0;
  constexpr std::size_t kUndo = 300'000;
  CHECK(most_beside(0) < kChunks);
  CHECK(most_beside(kUndo) < kChunks + kUndo);
  // Without a limit the numbers of before the last update are there besides.
  CHECK(most_beside(std::size_t{1} << 40U) > 2.0 * kChunks);
}

TEST_CASE("Blocks of a pool return to the system but for small ones", "[memory]") {
  factor_graph::storage::BlockPool<double> pool;
  std::vector<double*> blocks;
  for (std::size_t count = 1000; count < 1100; ++count) blocks.push_back(pool.take(count));
  CHECK(pool.bytes() >= 1000 * 100 * sizeof(double));
  // In another order than they came in.
  for (std::size_t i = 0; i < 100; ++i) pool.give_back(blocks[i * 37 % 100], 1000 + i * 37 % 100);
  CHECK(pool.bytes() == 0);

  double* small = pool.take(20);
  const std::size_t bytes = pool.bytes();
  pool.give_back(small, 20);
  CHECK(pool.take(24) == small);
  CHECK(pool.bytes() == bytes);
}

TEST_CASE("A pool that moves takes its blocks along", "[memory]") {
  factor_graph::storage::BlockPool<double> pool;
  double* block = pool.take(5000);
  block[4999] = 1.0;
  factor_graph::storage::BlockPool<double> other(std::move(pool));
  CHECK(block[4999] == 1.0);
  other.give_back(block, 5000);
  CHECK(other.bytes() == 0);
  other.take(3000);  // Goes with its pool.
}
