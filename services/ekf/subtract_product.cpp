#include "services/ekf/subtract_product.hpp"

#include <cstring>

// Wide vectors are never passed to or from a function here, so the warning does not apply.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace understory::ekf {
namespace {

using Pair = double __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));

constexpr int kColumns = 4;

/// One tile of two vectors by four columns, all its sums in registers.
template <typename Vector>
[[gnu::always_inline]] inline void tile(double* out, std::int64_t out_stride, const double* a,
                                        std::int64_t a_stride, const double* b,
                                        std::int64_t b_stride, int depth) {
  constexpr int kWidth = sizeof(Vector) / sizeof(double);
  Vector sum[kColumns][2];
  for (int j = 0; j < kColumns; ++j) sum[j][0] = sum[j][1] = Vector{};
  for (int k = 0; k < depth; ++k) {
    Vector upper;
    Vector lower;
    std::memcpy(&upper, a + k * a_stride, sizeof(Vector));
    std::memcpy(&lower, a + k * a_stride + kWidth, sizeof(Vector));
    for (int j = 0; j < kColumns; ++j) {
      const Vector y = b[k * b_stride + j] - Vector{};
      sum[j][0] += upper * y;
      sum[j][1] += lower * y;
    }
  }
  for (int j = 0; j < kColumns; ++j) {
    for (int r = 0; r < 2; ++r) {
      double* at = out + j * out_stride + r * kWidth;
      Vector value;
      std::memcpy(&value, at, sizeof(value));
      value -= sum[j][r];
      std::memcpy(at, &value, sizeof(value));
    }
  }
}

template <typename Vector>
[[gnu::always_inline]] inline void all_tiles(Panel out, ConstPanel a, ConstPanel b, int rows,
                                             int columns, int depth, bool lower_only) {
  constexpr int kRows = 2 * sizeof(Vector) / sizeof(double);
  for (int j = 0; j < columns; j += kColumns) {
    for (int i = lower_only ? j / kRows * kRows : 0; i < rows; i += kRows) {
      tile<Vector>(out.data + j * out.stride + i, out.stride, a.data + i, a.stride, b.data + j,
                   b.stride, depth);
    }
  }
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void with_avx2(Panel out, ConstPanel a, ConstPanel b, int rows,
                                           int columns, int depth, bool lower_only) {
  all_tiles<Quad>(out, a, b, rows, columns, depth, lower_only);
}
#endif

}  // namespace

void subtract_product(Panel out, ConstPanel a, ConstPanel b, int rows, int columns, int depth,
                      bool lower_only) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return with_avx2(out, a, b, rows, columns, depth, lower_only);
  }
#endif
  all_tiles<Pair>(out, a, b, rows, columns, depth, lower_only);
}

}  // namespace understory::ekf
