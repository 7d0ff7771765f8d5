// The front kernel, written once for every width of vector registers. Included by the files that
// are compiled for one kind of processor each: nothing here may be visible in other files.
#pragma once

#include <cmath>
#include <cstring>

#include "common/factor_graph/bayes_tree/front_kernel.hpp"

namespace understory::factor_graph::bayes_tree {
namespace {

template <int width>
struct VectorOf {
  typedef double type __attribute__((vector_size(width * 8), aligned(8), may_alias));
};

/// C[i.., j..] -= A[i.., 0..depth) A[j.., 0..depth)' for `vectors` registers of rows and `columns`
/// columns.
template <int width, int vectors, int columns>
inline void update_tile(double* front, long ld, long i, long j, long depth) {
  using Vector = typename VectorOf<width>::type;
  Vector sum[columns][vectors] = {};
  const double* rows = front + i;
  const double* across = front + j;
  for (long k = 0; k < depth; ++k, rows += ld, across += ld) {
    Vector a[vectors];
    for (int v = 0; v < vectors; ++v) {
      a[v] = *reinterpret_cast<const Vector*>(rows + v * width);
    }
    for (int c = 0; c < columns; ++c) {
      for (int v = 0; v < vectors; ++v) sum[c][v] += a[v] * across[c];
    }
  }
  for (int c = 0; c < columns; ++c) {
    for (int v = 0; v < vectors; ++v) {
      Vector* out = reinterpret_cast<Vector*>(front + (j + c) * ld + i + v * width);
      *out = *out - sum[c][v];
    }
  }
}

template <int columns>
inline void update_row(double* front, long ld, long i, long j, long depth) {
  double sum[columns] = {};
  for (long k = 0; k < depth; ++k) {
    const double a = front[k * ld + i];
    for (int c = 0; c < columns; ++c) sum[c] += a * front[k * ld + j + c];
  }
  for (int c = 0; c < columns; ++c) front[(j + c) * ld + i] -= sum[c];
}

/// Updates all rows from j of `columns` columns. Values above the diagonal are never read.
template <int width, int columns>
inline void update_columns(double* front, long ld, long j, long depth) {
  long i = j;
  for (; i + 3 * width <= ld; i += 3 * width) {
    update_tile<width, 3, columns>(front, ld, i, j, depth);
  }
  if (i + 2 * width <= ld) {
    update_tile<width, 2, columns>(front, ld, i, j, depth);
    i += 2 * width;
  }
  if (i + width <= ld) {
    update_tile<width, 1, columns>(front, ld, i, j, depth);
    i += width;
  }
  if constexpr (width > 4) {
    if (i + width / 2 <= ld) {
      update_tile<width / 2, 1, columns>(front, ld, i, j, depth);
      i += width / 2;
    }
  }
  for (; i < ld; ++i) update_row<columns>(front, ld, i, j, depth);
}

template <int width, int most>
inline void update_some(double* front, long ld, long j, long count, long depth) {
  if constexpr (most > 1) {
    if (count < most) return update_some<width, most - 1>(front, ld, j, count, depth);
  }
  update_columns<width, most>(front, ld, j, depth);
}

/// Factorises columns j .. j + count, already updated by the columns before.
inline int factorise_columns(double* front, long ld, long j, long count, const double* least,
                             int* left_out) {
  int bad = 0;
  for (long c = j; c < j + count; ++c) {
    double* column = front + c * ld;
    const double pivot = column[c];

    // A column with too small a pivot is left out.
    if (!(pivot > least[c])) {
      left_out[bad++] = static_cast<int>(c);
      for (long i = c; i < ld; ++i) column[i] = 0.0;
      column[c] = 1.0;
      continue;
    }

    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    column[c] = root;
    for (long i = c + 1; i < ld; ++i) column[i] *= inverse;

    // The column updates the later columns.
    for (long other = c + 1; other < j + count; ++other) {
      double* to = front + other * ld;
      const double factor = column[other];
      for (long i = other; i < ld; ++i) to[i] -= factor * column[i];
    }
  }
  return bad;
}

/// `panel`: columns at once, limited by the accumulators of a tile.
template <int width, int panel>
int partial_cholesky(double* front, int size, int pivots, const double* least, int* left_out) {
  constexpr long kColumns = panel;
  const long ld = size;
  int bad = 0;
  for (long j = 0; j < pivots; j += kColumns) {
    const long count = pivots - j < kColumns ? pivots - j : kColumns;
    if (j > 0) update_some<width, panel>(front, ld, j, count, j);
    bad += factorise_columns(front, ld, j, count, least, left_out + bad);
  }
  for (long j = pivots; j < ld; j += kColumns) {
    update_some<width, panel>(front, ld, j, ld - j < kColumns ? ld - j : kColumns, pivots);
  }
  return bad;
}

template <int width>
inline void add_numbers(double* to, const double* from, int count) {
  using Vector = typename VectorOf<width>::type;
  int i = 0;
  for (; i + width <= count; i += width) {
    Vector* out = reinterpret_cast<Vector*>(to + i);
    *out = *out + *reinterpret_cast<const Vector*>(from + i);
  }
  if constexpr (width > 2) return add_numbers<width / 2>(to + i, from + i, count - i);
  if (i < count) to[i] += from[i];
}

/// Adds one run's columns and another run's rows. `from`: the first of these columns, its row 0.
template <int width>
inline void add_block(double* front, long ld, const double* from, int rest, const RowRun& columns,
                      const RowRun& rows) {
  const bool is_below = rows.to > columns.to;
  double* to = front + (is_below ? columns.to * ld + rows.to : rows.to * ld + columns.to);
  from += rows.from;
  for (int c = 0; c < columns.length; ++c) {
    if (is_below) {
      add_numbers<width>(to + c * ld, from, rows.length);
    } else {
      // The parent has these rows and columns in reverse order: write the transposed element.
      for (int r = 0; r < rows.length; ++r) to[r * ld + c] += from[r];
    }
    from += rest - 1 - (columns.from + c);
  }
}

template <int width>
void add_runs(double* front, int size, const double* contribution, int rest, const RowRun* runs,
              int run_count) {
  const double* from = contribution;  // a column's row 0; values above the diagonal are not read
  const long ld = size;
  for (int a = 0; a < run_count; ++a) {
    const RowRun columns = runs[a];
    for (int b = a + 1; b < run_count; ++b) {
      add_block<width>(front, ld, from, rest, columns, runs[b]);
    }
    for (int c = 0; c < columns.length; ++c) {
      add_numbers<width>(front + (columns.to + c) * (ld + 1), from + columns.from + c,
                         columns.length - c);
      from += rest - 1 - (columns.from + c);
    }
  }
}

template <int width>
void solve_pivots(const double* front, int size, int pivots, double* step) {
  using Vector = typename VectorOf<width>::type;
  const long last = size - 1;
  for (long c = pivots; c-- > 0;) {
    const double* column = front + c * size;
    Vector sums = {};
    long r = c + 1;
    for (; r + width <= last; r += width) {
      sums +=
          *reinterpret_cast<const Vector*>(column + r) * *reinterpret_cast<const Vector*>(step + r);
    }
    double sum = column[last];
    for (int v = 0; v < width; ++v) sum -= sums[v];
    for (; r < last; ++r) sum -= column[r] * step[r];
    step[c] = sum / column[c];
  }
}

}  // namespace
}  // namespace understory::factor_graph::bayes_tree
