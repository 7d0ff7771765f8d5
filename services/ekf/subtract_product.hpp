// The dense kernel that takes most of the filter's time.
#pragma once

#include <cstdint>

namespace understory::ekf {

/// Rows and columns are processed in groups of this size: buffers reach to the next multiple.
inline constexpr int kKernelStep = 8;
/// `size` rounded up to the kernel's step.
constexpr int padded(int size) { return (size + kKernelStep - 1) / kKernelStep * kKernelStep; }

/// A column-major matrix for reading: `stride` numbers from column to column.
struct ConstPanel {
  const double* data = nullptr;
  std::int64_t stride = 0;
};
/// The same for writing.
struct Panel {
  double* data = nullptr;
  std::int64_t stride = 0;
};

/// out -= a b^T with out `rows` x `columns`, a `rows` x `depth`, b `columns` x `depth`; with
/// `lower_only`, values above the diagonal are undefined. Rows up to padded(rows) and columns up to
/// padded(columns) are read and written, too. Uses AVX2 if the processor has it (three times as
/// fast), else SSE2.
void subtract_product(Panel out, ConstPanel a, ConstPanel b, int rows, int columns, int depth,
                      bool lower_only);

}  // namespace understory::ekf
