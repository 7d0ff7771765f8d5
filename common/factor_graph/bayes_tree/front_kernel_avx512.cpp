// Compiled with AVX-512, run where the processor has it.
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/front_kernel_impl.hpp"

namespace understory::factor_graph::bayes_tree {

#if defined(__AVX512F__) && defined(__FMA__)
namespace {

/// Wide registers do not pay for shorter columns.
constexpr int kManyRows = 64;

int factorise(double* front, int size, int pivots, const double* least, int* left_out) {
  return size < kManyRows ? partial_cholesky<4, 4>(front, size, pivots, least, left_out)
                          : partial_cholesky<8, 8>(front, size, pivots, least, left_out);
}

}  // namespace

FrontKernel front_kernel_avx512() { return {&factorise, &add_runs<4>, &solve_pivots<4>}; }
#else
FrontKernel front_kernel_avx512() { return {}; }
#endif

}  // namespace understory::factor_graph::bayes_tree
