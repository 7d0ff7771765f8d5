// The one dense kernel that the filter's time goes into.
#pragma once

#include <cstdint>

namespace understory::ekf {

/// Columns and rows are handled in groups of so many: buffers must reach to the next multiple.
inline constexpr int kKernelStep = 8;
/// `size` rounded up to the kernel's step.
constexpr int padded(int size) { return (size + kKernelStep - 1) / kKernelStep * kKernelStep; }

/// A column-major matrix that begins at `data`, with `stride` numbers from column to column.
struct ConstPanel {
  const double* data = nullptr;
  std::int64_t stride = 0;
};
struct Panel {
  double* data = nullptr;
  std::int64_t stride = 0;
};

/// out -= a b^T with out `rows` x `columns`, a `rows` x `depth`, b `columns` x `depth`; with
/// `lower_only`, above the diagonal nothing that is written means anything. Rows up to
/// padded(rows) and columns up to padded(columns) are read and written too. Uses AVX2 where the
/// processor has it (three times as fast here), else what every processor has.
void subtract_product(Panel out, ConstPanel a, ConstPanel b, int rows, int columns, int depth,
                      bool lower_only);

}  // namespace understory::ekf
