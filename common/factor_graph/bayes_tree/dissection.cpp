#include "common/factor_graph/bayes_tree/dissection.hpp"

#include <cholmod.h>

#include <algorithm>
#include <mutex>

namespace understory::factor_graph::bayes_tree {
namespace {

/// METIS uses the C library's rand() and seeds it in each call: two parallel calls would influence
/// each other.
std::mutex& random_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Columns of the upper triangle.
struct Pattern {
  std::vector<int> starts{0};
  std::vector<int> rows;
};

Pattern pattern_of(const ElementLists& elements, std::span<const int> number_of, int count) {
  std::vector<std::vector<int>> elements_of(static_cast<std::size_t>(count));
  for (int e = 0; e < elements.count(); ++e) {
    for (const int v : elements[e]) {
      const int number = number_of[static_cast<std::size_t>(v)];
      if (number >= 0) elements_of[static_cast<std::size_t>(number)].push_back(e);
    }
  }

  Pattern pattern;
  std::vector<int> tied_to(static_cast<std::size_t>(count), -1);
  for (int column = 0; column < count; ++column) {
    tied_to[static_cast<std::size_t>(column)] = column;
    pattern.rows.push_back(column);
    for (const int e : elements_of[static_cast<std::size_t>(column)]) {
      for (const int v : elements[e]) {
        const int row = number_of[static_cast<std::size_t>(v)];
        if (row < 0 || row > column || tied_to[static_cast<std::size_t>(row)] == column) continue;
        tied_to[static_cast<std::size_t>(row)] = column;
        pattern.rows.push_back(row);
      }
    }
    std::sort(pattern.rows.begin() + pattern.starts.back(), pattern.rows.end());
    pattern.starts.push_back(static_cast<int>(pattern.rows.size()));
  }
  return pattern;
}

}  // namespace

std::span<const int> ElementLists::operator[](int number) const {
  const auto at = static_cast<std::size_t>(number);
  const auto begin = static_cast<std::size_t>(starts[at]);
  const auto end =
      at + 1 < starts.size() ? static_cast<std::size_t>(starts[at + 1]) : entries.size();
  return entries.subspan(begin, end - begin);
}

std::vector<int> dissect(const ElementLists& elements, std::span<const int> number_of, int count) {
  Pattern pattern = pattern_of(elements, number_of, count);
  cholmod_sparse matrix{};
  matrix.nrow = matrix.ncol = static_cast<std::size_t>(count);
  matrix.nzmax = pattern.rows.size();
  matrix.p = pattern.starts.data();
  matrix.i = pattern.rows.data();
  matrix.stype = 1;
  matrix.itype = CHOLMOD_INT;
  matrix.xtype = CHOLMOD_PATTERN;
  matrix.sorted = matrix.packed = 1;

  std::vector<int> order(static_cast<std::size_t>(count));
  cholmod_common common;
  cholmod_start(&common);
  common.print = 0;
  {
    const std::lock_guard lock(random_mutex());
    constexpr int kPostorder = 1;
    if (cholmod_metis(&matrix, nullptr, 0, kPostorder, order.data(), &common) == 0) order.clear();
  }
  cholmod_finish(&common);
  return order;
}

}  // namespace understory::factor_graph::bayes_tree
