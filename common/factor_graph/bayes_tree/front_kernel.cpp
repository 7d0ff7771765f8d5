#include "common/factor_graph/bayes_tree/front_kernel.hpp"

#include "common/factor_graph/bayes_tree/front_kernel_impl.hpp"

namespace understory::factor_graph::bayes_tree {

FrontKernel front_kernel_portable() {
  return {&partial_cholesky<2, 4>, &add_runs<2>, &solve_pivots<2>};
}

FrontKernel front_kernel() {
#if defined(__x86_64__)
  if (front_kernel_avx512().factorise != nullptr && __builtin_cpu_supports("avx512f") &&
      __builtin_cpu_supports("fma")) {
    return front_kernel_avx512();
  }
  if (front_kernel_avx2().factorise != nullptr && __builtin_cpu_supports("avx2") &&
      __builtin_cpu_supports("fma")) {
    return front_kernel_avx2();
  }
#endif
  return front_kernel_portable();
}

}  // namespace understory::factor_graph::bayes_tree
