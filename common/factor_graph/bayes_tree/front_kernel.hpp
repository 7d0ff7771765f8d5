// Dense elimination of the leading variables of one front.
#pragma once

namespace understory::factor_graph::bayes_tree {

/// Rows of a child's contribution that are contiguous in the parent's front too.
struct RowRun {
  int from, to, length;
};

/// Functions on one front, compiled for one kind of processor.
///
/// Factorisation: partial Cholesky in place. `front`: symmetric, size x size, column-major, lower
/// triangle. The first `pivots` columns become those of L; the rest becomes the Schur complement.
/// A pivot that is not above least[column] is left out: its column becomes that of the identity.
/// The last row and column (the right-hand side) is never a pivot. Returns the number of pivots
/// left out; their indices go to `left_out`.
///
/// Assembly: adds a child's contribution, `rest` rows, lower triangle column by column, at the rows
/// given by the runs; the last run is the right-hand side.
///
/// Back-substitution: `step` has the separator's values after `pivots` free places, which are
/// filled.
struct FrontKernel {
  int (*factorise)(double* front, int size, int pivots, const double* least,
                   int* left_out) = nullptr;
  void (*add_contribution)(double* front, int size, const double* contribution, int rest,
                           const RowRun* runs, int run_count) = nullptr;
  void (*back_substitute)(const double* front, int size, int pivots, double* step) = nullptr;
};

/// The fastest kernel for this processor.
FrontKernel front_kernel();

/// Kernel for any processor.
FrontKernel front_kernel_portable();
/// Kernel with AVX2 and FMA; empty where the compiler does not support it.
FrontKernel front_kernel_avx2();
/// Kernel with AVX-512; empty where the compiler does not support it.
FrontKernel front_kernel_avx512();

}  // namespace understory::factor_graph::bayes_tree
