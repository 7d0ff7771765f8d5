#include "common/factor_graph/bayes_tree/minimum_degree.hpp"

#include <bit>
#include <limits>

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

constexpr int kWordBits = 64;
/// Degree of a variable that has been eliminated.
constexpr int kGone = std::numeric_limits<int>::max();

std::size_t word_of(int variable) { return static_cast<std::size_t>(variable) / kWordBits; }
std::uint64_t bit_of(int variable) {
  return std::uint64_t{1} << (static_cast<unsigned>(variable) % kWordBits);
}

/// Calls f(variable) for every bit.
template <typename F>
void for_each_bit(const std::uint64_t* bits, std::size_t words, F&& f) {
  for (std::size_t w = 0; w < words; ++w) {
    for (std::uint64_t left = bits[w]; left != 0; left &= left - 1)
      f(static_cast<int>(w) * kWordBits + std::countr_zero(left));
  }
}

}  // namespace

void MinimumDegree::tie(const EliminationProblem& problem) {
  words_ = word_of(problem.size() - 1) + 1;
  bits_.assign(static_cast<std::size_t>(problem.size()) * words_, 0);
  for (int e = 0; e < problem.element_count(); ++e) {
    const std::span<const int> tied = problem.element(e);
    if (tied.size() == 2) {
      row(tied[0])[word_of(tied[1])] |= bit_of(tied[1]);
      row(tied[1])[word_of(tied[0])] |= bit_of(tied[0]);
      continue;
    }
    mask_.assign(words_, 0);
    for (const int v : tied) mask_[word_of(v)] |= bit_of(v);
    for (const int v : tied)
      for (std::size_t w = 0; w < words_; ++w) row(v)[w] |= mask_[w];
  }

  degree_.assign(static_cast<std::size_t>(problem.size()), 0);
  left_ = 0;
  for (int v = 0; v < problem.size(); ++v) {
    row(v)[word_of(v)] &= ~bit_of(v);
    int& degree = degree_[static_cast<std::size_t>(v)];
    for_each_bit(row(v), words_, [&](int other) { degree += problem.dimension(other); });
    left_ += problem.dimension(v);
  }
}

/// The variable with the least degree; kNone at the end of the group.
int MinimumDegree::next_of(int group, const EliminationProblem& problem) const {
  int next = graph::kNone;
  int least = kGone;
  for (int v = 0; v < problem.size(); ++v) {
    const int degree = degree_[static_cast<std::size_t>(v)];
    if (degree >= least || problem.group(v) != group) continue;
    least = degree;
    next = v;
  }
  return next;
}

void MinimumDegree::eliminate(int variable, const EliminationProblem& problem) {
  const std::uint64_t* tied = row(variable);
  const int dimension = problem.dimension(variable);
  for_each_bit(tied, words_, [&](int other) {
    std::uint64_t* theirs = row(other);
    int& degree = degree_[static_cast<std::size_t>(other)];
    theirs[word_of(variable)] &= ~bit_of(variable);
    degree -= dimension;
    for (std::size_t w = 0; w < words_; ++w) {
      std::uint64_t fresh = tied[w] & ~theirs[w];
      if (w == word_of(other)) fresh &= ~bit_of(other);
      if (fresh == 0) continue;
      theirs[w] |= fresh;
      for (; fresh != 0; fresh &= fresh - 1)
        degree += problem.dimension(static_cast<int>(w) * kWordBits + std::countr_zero(fresh));
    }
  });
  degree_[static_cast<std::size_t>(variable)] = kGone;
  left_ -= dimension;
}

void MinimumDegree::order(const EliminationProblem& problem, std::vector<int>& order) {
  order.clear();
  if (problem.size() == 0) return;
  tie(problem);
  for (int group = EliminationProblem::kOthers; group <= EliminationProblem::kLast; ++group) {
    for (int v = next_of(group, problem); v != graph::kNone; v = next_of(group, problem)) {
      const bool is_dense = degree_[static_cast<std::size_t>(v)] == left_ - problem.dimension(v);
      order.push_back(v);
      if (!is_dense || group != EliminationProblem::kLast) {
        eliminate(v, problem);
        continue;
      }

      // All remaining variables are connected to each other: any order is equal.
      degree_[static_cast<std::size_t>(v)] = kGone;
      for (int other = 0; other < problem.size(); ++other)
        if (degree_[static_cast<std::size_t>(other)] != kGone) order.push_back(other);
      return;
    }
  }
}

}  // namespace understory::factor_graph::bayes_tree
