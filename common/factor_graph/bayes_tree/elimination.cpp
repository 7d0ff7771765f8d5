#include "common/factor_graph/bayes_tree/elimination.hpp"

#include <algorithm>

namespace understory::factor_graph::bayes_tree {
namespace {

/// A pivot below this part of the information that went into it is rounding noise.
constexpr double kLeastPivot = 1e-13;
/// A leaf with this many times more separator rows than pivots is cheaper to compute again than to
/// keep: a pose that observed a hundred landmarks.
constexpr int kManyRows = 8;
constexpr int kFewRows = 24;  ///< With fewer separator rows it is always kept.

bool worth_keeping(const CliqueRecord& clique) {
  const int rest = clique.size - clique.pivots;
  return clique.first_child != graph::kNone || rest < kFewRows || rest < kManyRows * clique.pivots;
}

}  // namespace

/// Those of `cliques` for which is_listed(), which is false of all others.
template <typename IsListed>
void Elimination::list_children_first(std::span<const int> cliques, const IsListed& is_listed,
                                      std::vector<int>& listed) {
  listed.clear();
  pending_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);

  // How many children each one has to wait for.
  for (const int c : cliques) {
    const int parent = cliques_[c].parent;
    if (is_listed(c) && is_listed(parent)) ++pending_[static_cast<std::size_t>(parent)];
  }

  // Those without such children, then each as soon as its last child is listed.
  for (const int c : cliques) {
    if (is_listed(c) && pending_[static_cast<std::size_t>(c)] == 0) listed.push_back(c);
  }
  for (std::size_t i = 0; i < listed.size(); ++i) {
    const int parent = cliques_[listed[i]].parent;
    if (is_listed(parent) && --pending_[static_cast<std::size_t>(parent)] == 0) {
      listed.push_back(parent);
    }
  }
}

void Elimination::list_dirty(const Marks& marks, std::vector<int>& computed) {
  list_children_first(
      marks.dirty(), [&](int c) { return marks.is_dirty(c); }, computed);
}

void Elimination::restore_lost() {
  is_lost_.resize(static_cast<std::size_t>(cliques_.capacity()), 0);
  for (const int c : cliques_.lost()) is_lost_[static_cast<std::size_t>(c)] = 1;
  const auto is_lost = [&](int c) { return is_lost_[static_cast<std::size_t>(c)] != 0; };
  list_children_first(cliques_.lost(), is_lost, restored_);

  for (const int c : restored_) {
    compute(cliques_[c], own_space_);
    store(cliques_[c], cliques_.lost_panel(c));
  }
  for (const int c : restored_) is_lost_[static_cast<std::size_t>(c)] = 0;
}

void Elimination::place_rows(const CliqueRecord& clique, Workspace& at) const {
  at.offset.resize(static_cast<std::size_t>(graph_.variable_capacity()));
  at.least.resize(static_cast<std::size_t>(clique.pivots));

  int row = 0;
  for (int i = 0; i < clique.row_count; ++i) {
    const graph::VariableRecord& variable = graph_.variable(clique.rows[i]);
    at.offset[static_cast<std::size_t>(clique.rows[i])] = row;
    const int size = dimension(variable.type);
    if (i < clique.frontal_count) {
      const int translations = variable.type == graph::VariableType::kPose2 ? 2 : 3;
      double* least = at.least.data() + row;
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

/// [J | b]' [J | b] into the front.
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

}  // namespace

void Elimination::add_factors(const CliqueRecord& clique, Workspace& at) {
  for (int f = clique.first_factor; f != graph::kNone; f = graph_.factor(f).next) {
    const graph::FactorRecord& factor = graph_.factor(f);
    targets_.clear();
    for (const int v : graph_.variables_of(f)) {
      const int first = at.offset[static_cast<std::size_t>(v)];
      const int size = dimension(graph_.variable(v).type);
      for (int k = 0; k < size; ++k) targets_.push_back(first + k);
    }
    targets_.push_back(clique.size - 1);

    const int columns = factor.columns + 1;
    switch (factor.rows) {
      case 2:
        add_products<2>(factor.linear, columns, targets_.data(), at.front, clique.size);
        break;
      case 3:
        add_products<3>(factor.linear, columns, targets_.data(), at.front, clique.size);
        break;
      case 6:
        add_products<6>(factor.linear, columns, targets_.data(), at.front, clique.size);
        break;
      default:
        add_products_any(factor.linear, factor.rows, columns, targets_.data(), at.front,
                         clique.size);
    }
  }
}

/// Rows of the child's Schur complement in the parent's front, in runs that stay side by side.
void Elimination::find_runs(const CliqueRecord& child, const Workspace& at, int size) {
  runs_.clear();
  int row = 0;
  for (int i = child.frontal_count; i <= child.row_count; ++i) {
    const bool is_right = i == child.row_count;
    const int to = is_right ? size - 1 : at.offset[static_cast<std::size_t>(child.rows[i])];
    const int length = is_right ? 1 : dimension(graph_.variable(child.rows[i]).type);
    if (!runs_.empty() && runs_.back().to + runs_.back().length == to) {
      runs_.back().length += length;
    } else {
      runs_.push_back({row, to, length});
    }
    row += length;
  }
}

/// Adds the Schur complement whose `runs_` were found. `column_of(c)` points at its column c's row
/// 0 (what is above the diagonal is not read).
template <typename ColumnOf>
void Elimination::add_schur(const ColumnOf& column_of, double* front, int size) const {
  for (std::size_t a = 0; a < runs_.size(); ++a) {
    const Run column = runs_[a];
    for (int c = 0; c < column.length; ++c) {
      const double* from = column_of(column.from + c);
      double* to = front + static_cast<std::ptrdiff_t>(column.to + c) * size;

      for (int r = c; r < column.length; ++r) to[column.to + r] += from[column.from + r];
      for (std::size_t b = a + 1; b < runs_.size(); ++b) {
        const Run rows = runs_[b];
        if (rows.to > column.to) {
          for (int r = 0; r < rows.length; ++r) to[rows.to + r] += from[rows.from + r];
        } else {
          // The parent has these in another order: the upper triangle's other half.
          for (int r = 0; r < rows.length; ++r) {
            front[static_cast<std::ptrdiff_t>(rows.to + r) * size + column.to + c] +=
                from[rows.from + r];
          }
        }
      }
    }
  }
}

void Elimination::add_child(const CliqueRecord& child, Workspace& at, int size) {
  if (child.keeps_schur) {
    const double* schur = child.panel + child.panel_numbers();
    const std::ptrdiff_t rest = child.size - child.pivots;
    find_runs(child, at, size);
    // Column c begins with its row c, behind rest + (rest - 1) + ... numbers.
    const auto column_of = [&](std::ptrdiff_t c) { return schur + c * rest - c * (c - 1) / 2 - c; };
    add_schur(column_of, at.front, size);
    return;
  }

  compute(child, leaf_space_);
  const double* schur =
      leaf_space_.front + static_cast<std::ptrdiff_t>(child.pivots) * (child.size + 1);
  find_runs(child, at, size);
  add_schur([&](std::ptrdiff_t c) { return schur + c * child.size; }, at.front, size);
}

void Elimination::assemble(const CliqueRecord& clique, Workspace& at) {
  const auto size = static_cast<std::size_t>(clique.size);
  if (at.numbers.size() < size * size) at.numbers.resize(size * size);
  at.front = at.numbers.data();
  for (std::size_t c = 0; c < size; ++c) std::fill_n(at.front + c * (size + 1), size - c, 0.0);

  place_rows(clique, at);
  add_factors(clique, at);
  for (int c = clique.first_child; c != graph::kNone; c = cliques_[c].next_sibling) {
    add_child(cliques_[c], at, clique.size);
  }
}

/// The front, factorised; returns how many pivots were left out.
int Elimination::compute(const CliqueRecord& clique, Workspace& at) {
  assemble(clique, at);
  left_out_.resize(static_cast<std::size_t>(clique.pivots));
  return kernel_.factorise(at.front, clique.size, clique.pivots, at.least.data(), left_out_.data());
}

/// What is kept of the front.
void Elimination::store(const CliqueRecord& clique, double* to) const {
  const double* front = own_space_.front;
  to = std::copy_n(front, clique.panel_numbers(), to);
  const std::ptrdiff_t size = clique.size;
  if (clique.keeps_schur) {
    for (std::ptrdiff_t c = clique.pivots; c < size; ++c) {
      to = std::copy_n(front + c * (size + 1), size - c, to);
    }
  }
}

void Elimination::factorise(int id) {
  const int left_out = compute(cliques_[id], own_space_);
  double* to = cliques_.writable_panel(id, worth_keeping(cliques_[id]));
  store(cliques_[id], to);
  cliques_.set_left_out(id, left_out);
}

}  // namespace understory::factor_graph::bayes_tree
