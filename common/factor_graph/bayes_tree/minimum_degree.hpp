// The order of elimination of few variables.
#pragma once

#include <cstdint>
#include <vector>

#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {

/// Orders by exact minimum degree: of those of the earliest group that are left, the variable with
/// the fewest degrees of freedom around it goes next, and ties all these together. Who is tied to
/// whom is a bit for each pair: below some hundred variables that is a fraction of what CCOLAMD
/// takes, which looks at every element, and the fill is no larger. Keeps its scratch memory.
class MinimumDegree {
 public:
  /// Most variables: beyond, the bits cost more than they save.
  static constexpr int kMost = 448;

  /// Writes the variable at each position. The groups must be known. Cost: the elements, and the
  /// ties times the words of a row of bits.
  void order(const EliminationProblem& problem, std::vector<int>& order);

 private:
  std::uint64_t* row(int variable) {
    return bits_.data() + static_cast<std::size_t>(variable) * words_;
  }
  void tie(const EliminationProblem& problem);
  int next_of(int group, const EliminationProblem& problem) const;
  void eliminate(int variable, const EliminationProblem& problem);

  std::size_t words_ = 0;            ///< Of a row.
  std::vector<std::uint64_t> bits_;  ///< By variable: whom it is tied to.
  std::vector<std::uint64_t> mask_;  ///< Of one element.
  std::vector<int> degree_;          ///< Degrees of freedom it is tied to; kGone.
  int left_ = 0;                     ///< Degrees of freedom of those that are left.
};

}  // namespace understory::factor_graph::bayes_tree
