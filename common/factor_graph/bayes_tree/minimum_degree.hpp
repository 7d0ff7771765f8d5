// The order of elimination of few variables.
#pragma once

#include <cstdint>
#include <vector>

#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {

/// Orders by exact minimum degree: among the remaining variables of the earliest group, the
/// variable with the fewest degrees of freedom in its neighbourhood is next, and its neighbours
/// become connected. Connections are one bit per pair: below some hundred variables this takes a
/// fraction of the time of CCOLAMD, which visits every element, and the fill is no larger. Keeps
/// its scratch memory.
class MinimumDegree {
 public:
  /// Largest number of variables: beyond it the bits cost more than they save.
  static constexpr int kMost = 448;

  /// Writes the variable at each position. The groups must be known. Cost: the elements, and the
  /// connections times the words of a row of bits.
  void order(const EliminationProblem& problem, std::vector<int>& order);

 private:
  std::uint64_t* row(int variable) {
    return bits_.data() + static_cast<std::size_t>(variable) * words_;
  }
  void tie(const EliminationProblem& problem);
  int next_of(int group, const EliminationProblem& problem) const;
  void eliminate(int variable, const EliminationProblem& problem);

  std::size_t words_ = 0;            ///< Words of a row.
  std::vector<std::uint64_t> bits_;  ///< By variable: its neighbours.
  std::vector<std::uint64_t> mask_;  ///< Variables of one element.
  std::vector<int> degree_;          ///< Degrees of freedom of its neighbours; or kGone.
  int left_ = 0;                     ///< Degrees of freedom of the remaining variables.
};

}  // namespace understory::factor_graph::bayes_tree
