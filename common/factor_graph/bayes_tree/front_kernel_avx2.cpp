// Compiled with AVX2 and FMA, run where the processor has them.
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/bayes_tree/front_kernel_impl.hpp"

namespace understory::factor_graph::bayes_tree {

#if defined(__AVX2__) && defined(__FMA__)
FrontKernel front_kernel_avx2() {
  return {&partial_cholesky<4, 4>, &add_runs<4>, &solve_pivots<4>};
}
#else
FrontKernel front_kernel_avx2() { return {}; }
#endif

}  // namespace understory::factor_graph::bayes_tree
