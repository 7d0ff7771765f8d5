#include "common/factor_graph/bayes_tree/elimination.hpp"

#include <algorithm>

#include "common/factor_graph/bayes_tree/elimination_problem.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

/// A pivot below this fraction of its summed information is rounding noise.
constexpr double kLeastPivot = 1e-13;
/// A contribution is stored if its computation takes more time than this per number [us], or if it
/// is small: on a sphere of 2500 poses the others are a sixth of all memory and cost 1.5 % of the
/// fronts' time.
constexpr double kWorthKeeping = 0.006;
constexpr int kFewRows = 48;

bool worth_keeping(const CliqueRecord& clique) {
  return clique.size - clique.pivots < kFewRows ||
         clique.rebuild_us > kWorthKeeping * static_cast<double>(clique.contribution_numbers());
}

}  // namespace

void Elimination::list_dirty(const Marks& marks, std::vector<int>& computed) {
  computed.clear();
  pending_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);

  // Count the children that each one waits for.
  for (const int c : marks.dirty()) {
    const int parent = cliques_[c].parent;
    if (marks.is_dirty(c) && marks.is_dirty(parent)) ++pending_[static_cast<std::size_t>(parent)];
  }

  // List cliques without such children, then each clique after its last child.
  for (const int c : marks.dirty()) {
    if (marks.is_dirty(c) && pending_[static_cast<std::size_t>(c)] == 0) computed.push_back(c);
  }
  for (std::size_t i = 0; i < computed.size(); ++i) {
    const int parent = cliques_[computed[i]].parent;
    if (marks.is_dirty(parent) && --pending_[static_cast<std::size_t>(parent)] == 0) {
      computed.push_back(parent);
    }
  }
}

/// Children first, one subtree after the other, so that contributions which are dropped after the
/// parent's computation exist only for a short time.
void Elimination::order_by_subtrees(std::span<const int> cliques) {
  is_listed_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);
  for (const int c : cliques) is_listed_[static_cast<std::size_t>(c)] = 1;

  // Parents first; reversed below.
  order_.clear();
  for (const int top : cliques) {
    if (is_listed_[static_cast<std::size_t>(cliques_[top].parent)] != 0) continue;
    stack_.assign(1, top);
    while (!stack_.empty()) {
      const int c = stack_.back();
      stack_.pop_back();
      order_.push_back(c);
      for (int k = cliques_[c].first_child; k != graph::kNone; k = cliques_[k].next_sibling) {
        if (is_listed_[static_cast<std::size_t>(k)] != 0) stack_.push_back(k);
      }
    }
  }
  std::reverse(order_.begin(), order_.end());

  for (const int c : cliques) is_listed_[static_cast<std::size_t>(c)] = 0;
}

void Elimination::place_rows(const CliqueRecord& clique) {
  offset_.resize(static_cast<std::size_t>(graph_.variable_capacity()));
  least_.resize(static_cast<std::size_t>(clique.pivots));

  int row = 0;
  for (int i = 0; i < clique.row_count; ++i) {
    const graph::VariableRecord& variable = graph_.variable(clique.rows[i]);
    offset_[static_cast<std::size_t>(clique.rows[i])] = row;
    const int size = dimension(variable.type);
    if (i < clique.frontal_count) {
      const int translations = variable.type == graph::VariableType::kPose2 ? 2 : 3;
      double* least = least_.data() + row;
      for (int k = 0; k < size; ++k) {
        const double scale = variable.scale[k < translations ? 0 : 1];
        least[k] = kLeastPivot * scale * scale;
      }
    }
    row += size;
  }
}

namespace {

template <int rows>
double dot(const double* a, const double* b) {
  double sum = 0.0;
  for (int i = 0; i < rows; ++i) sum += a[i] * b[i];
  return sum;
}

/// Adds [J | b]' [J | b] to the front.
template <int rows>
void add_products(const double* j, int columns, const int* targets, double* front, int size) {
  for (int a = 0; a < columns; ++a) {
    for (int b = 0; b <= a; ++b) {
      const int low = std::max(targets[a], targets[b]);
      const int high = std::min(targets[a], targets[b]);
      front[static_cast<std::ptrdiff_t>(high) * size + low] +=
          dot<rows>(j + a * rows, j + b * rows);
    }
  }
}

void add_products_any(const double* j, int rows, int columns, const int* targets, double* front,
                      int size) {
  for (int a = 0; a < columns; ++a) {
    for (int b = 0; b <= a; ++b) {
      double sum = 0.0;
      for (int i = 0; i < rows; ++i) sum += j[a * rows + i] * j[b * rows + i];
      const int low = std::max(targets[a], targets[b]);
      const int high = std::min(targets[a], targets[b]);
      front[static_cast<std::ptrdiff_t>(high) * size + low] += sum;
    }
  }
}

/// The same for an observation in the plane, 2 x (3 + 2 + 1): most factors of a map.
void add_observation(const double* j, std::ptrdiff_t pose, std::ptrdiff_t point, double* front,
                     std::ptrdiff_t size) {
  const auto product = [&](int a, int b) { return dot<2>(j + 2 * a, j + 2 * b); };
  double* of_pose = front + pose * size;
  double* of_point = front + point * size;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) of_pose[a * size + pose + b] += product(b, a);
  for (int a = 0; a < 2; ++a)
    for (int b = a; b < 2; ++b) of_point[a * size + point + b] += product(3 + b, 3 + a);

  if (pose < point) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 2; ++b) of_pose[a * size + point + b] += product(3 + b, a);
  } else {
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 3; ++b) of_point[a * size + pose + b] += product(b, 3 + a);
  }

  const std::ptrdiff_t right = size - 1;
  for (int a = 0; a < 3; ++a) of_pose[a * size + right] += product(5, a);
  for (int a = 0; a < 2; ++a) of_point[a * size + right] += product(5, 3 + a);
  front[right * size + right] += product(5, 5);
}

}  // namespace

void Elimination::add_factors(const CliqueRecord& clique) {
  // A clique being computed has no removed factors.
  const std::span<const int> factors = clique.assembled();
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (i + 2 * graph::kFetchAhead < factors.size())
      graph_.fetch_record(factors[i + 2 * graph::kFetchAhead]);
    if (i + graph::kFetchAhead < factors.size())
      graph_.fetch_linear(factors[i + graph::kFetchAhead]);
    const int f = factors[i];
    const graph::FactorRecord& factor = graph_.factor(f);
    if (factor.kind == graph::FactorKind::kPoint2) {
      const std::span<const int> tied = graph_.variables_of(f);
      add_observation(factor.linear, offset_[static_cast<std::size_t>(tied[0])],
                      offset_[static_cast<std::size_t>(tied[1])], front_, clique.size);
      continue;
    }
    targets_.clear();
    for (const int v : graph_.variables_of(f)) {
      const int first = offset_[static_cast<std::size_t>(v)];
      const int size = dimension(graph_.variable(v).type);
      for (int k = 0; k < size; ++k) targets_.push_back(first + k);
    }
    targets_.push_back(clique.size - 1);

    const int columns = factor.columns + 1;
    switch (factor.rows) {
      case 2:
        add_products<2>(factor.linear, columns, targets_.data(), front_, clique.size);
        break;
      case 3:
        add_products<3>(factor.linear, columns, targets_.data(), front_, clique.size);
        break;
      case 6:
        add_products<6>(factor.linear, columns, targets_.data(), front_, clique.size);
        break;
      default:
        add_products_any(factor.linear, factor.rows, columns, targets_.data(), front_, clique.size);
    }
  }
}

/// Rows of the child's Schur complement in the parent's front, in contiguous runs.
void Elimination::find_runs(const CliqueRecord& child, int size) {
  runs_.clear();
  int row = 0;
  for (int i = child.frontal_count; i <= child.row_count; ++i) {
    const bool is_right = i == child.row_count;
    const int to = is_right ? size - 1 : offset_[static_cast<std::size_t>(child.rows[i])];
    const int length = is_right ? 1 : dimension(graph_.variable(child.rows[i]).type);
    if (!runs_.empty() && runs_.back().to + runs_.back().length == to) {
      runs_.back().length += length;
    } else {
      runs_.push_back({row, to, length});
    }
    row += length;
  }
}

void Elimination::add_child(int id, int size) {
  const CliqueRecord& child = cliques_[id];
  find_runs(child, size);
  kernel_.add_contribution(front_, size, cliques_.contributions().find(id),
                           child.size - child.pivots, runs_.data(), static_cast<int>(runs_.size()));
}

void Elimination::assemble(const CliqueRecord& clique) {
  const auto size = static_cast<std::size_t>(clique.size);
  if (numbers_.size() < size * size) numbers_.resize(size * size);
  front_ = numbers_.data();
  for (std::size_t c = 0; c < size; ++c) std::fill_n(front_ + c * (size + 1), size - c, 0.0);

  place_rows(clique);
  add_factors(clique);
  for (int c = clique.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    add_child(c, clique.size);
  }
}

/// Factorises the front; returns the number of pivots left out. The children's contributions must
/// exist; those not kept are dropped afterwards.
int Elimination::compute(const CliqueRecord& clique) {
  assemble(clique);
  for (int c = clique.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (!cliques_[c].keeps_contribution) cliques_.contributions().drop(c);
  }
  left_out_.resize(static_cast<std::size_t>(clique.pivots));
  return kernel_.factorise(front_, clique.size, clique.pivots, least_.data(), left_out_.data());
}

void Elimination::list_missing_children(int id) {
  for (int c = cliques_[id].first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (cliques_.contributions().find(c) == nullptr) missing_.push_back(c);
  }
}

/// Computes the missing contributions of the clique's children again.
void Elimination::rebuild_children(int id) {
  missing_.clear();
  list_missing_children(id);
  for (std::size_t i = 0; i < missing_.size(); ++i) list_missing_children(missing_[i]);
  for (std::size_t i = missing_.size(); i-- > 0;) {
    compute(cliques_[missing_[i]]);
    store_contribution(missing_[i]);
  }
}

void Elimination::store_contribution(int id) {
  const CliqueRecord& clique = cliques_[id];
  double* to = cliques_.contributions().make(id, clique.contribution_numbers());
  const std::ptrdiff_t size = clique.size;
  for (std::ptrdiff_t c = clique.pivots; c < size; ++c) {
    to = std::copy_n(front_ + c * (size + 1), size - c, to);
  }
}

/// Computes the time to rebuild the contribution, and decides whether it is stored.
void Elimination::judge_contribution(int id) {
  CliqueRecord& clique = cliques_.edit(id);
  double us = front_time_us(clique.pivots, clique.size - clique.pivots - 1);
  for (int c = clique.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    if (!cliques_[c].keeps_contribution) us += cliques_[c].rebuild_us;
  }
  clique.rebuild_us = static_cast<float>(us);
  clique.keeps_contribution = worth_keeping(clique);
}

void Elimination::factorise(std::span<const int> cliques) {
  order_by_subtrees(cliques);
  for (const int c : order_) {
    rebuild_children(c);
    const int left_out = compute(cliques_[c]);
    double* to = cliques_.writable_panel(c);
    std::copy_n(front_, cliques_[c].panel_numbers(), to);
    judge_contribution(c);
    if (cliques_[c].parent != CliqueTree::kRoot) store_contribution(c);
    cliques_.set_left_out(c, left_out);
  }
}

void Elimination::restore_lost() {
  order_by_subtrees(cliques_.lost());
  for (const int c : order_) {
    rebuild_children(c);
    compute(cliques_[c]);
    std::copy_n(front_, cliques_[c].panel_numbers(), cliques_.lost_panel(c));
    if (cliques_[c].parent != CliqueTree::kRoot) store_contribution(c);
  }
}

}  // namespace understory::factor_graph::bayes_tree
