#include "services/landmark_extractor/ground/band_solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "services/landmark_extractor/lanes.hpp"

namespace understory::landmark_extractor::ground {
namespace {

/// Whole registers: the zeros behind the band have no effect.
[[gnu::always_inline]] inline void finish_column(float* column, std::size_t band) {
  const float scale = 1.0F / std::sqrt(std::max(column[0], 1e-9F));
  for (std::size_t k = 0; k < padded_to_lanes(band); ++k) column[k] *= scale;
}

/// Two columns at a time update those after them: each is loaded and stored half as often.
[[gnu::always_inline]] inline void factorise(const BandLayout& layout, float* matrix) {
  const std::size_t n = layout.size;
  const std::size_t band = layout.band;
  const std::size_t stride = layout.stride;
  std::size_t j = 0;
  for (; j + 1 < n; j += 2) {
    float* const first = matrix + j * stride;
    float* const second = first + stride;
    finish_column(first, band);
    for (std::size_t t = 0; t < padded_to_lanes(band); ++t) second[t] -= first[1] * first[1 + t];
    finish_column(second, band);
    const std::size_t reach = std::min(band + 1, n - j);
    for (std::size_t k = 2; k < reach; ++k) {
      float* __restrict__ other = first + k * stride;
      const float* __restrict__ a = first + k;
      const float* __restrict__ b = second + k - 1;
      const float by_a = a[0];
      const float by_b = b[0];
      for (std::size_t t = 0; t < padded_to_lanes(band + 1 - k); ++t)
        other[t] -= by_a * a[t] + by_b * b[t];
    }
  }
  if (j < n) finish_column(matrix + j * stride, band);
}

[[gnu::always_inline]] inline void substitute(const BandLayout& layout, const float* matrix,
                                              float* right) {
  const std::size_t rest = padded_to_lanes(layout.band - 1);
  for (std::size_t j = 0; j < layout.size; ++j) {
    const float* __restrict__ column = matrix + j * layout.stride;
    const float value = right[j] / column[0];
    right[j] = value;
    float* __restrict__ after = right + j + 1;
    for (std::size_t k = 0; k < rest; ++k) after[k] -= column[k + 1] * value;
  }
  for (std::size_t j = layout.size; j-- > 0;) {
    const float* column = matrix + j * layout.stride;
    const float* after = right + j + 1;
    // Several sums side by side: a single one would stall on its own latency.
    std::array<float, kLanes> sums{};
    for (std::size_t k = 0; k < rest; k += kLanes) {
      for (std::size_t l = 0; l < kLanes; ++l) sums[l] += column[k + l + 1] * after[k + l];
    }
    float sum = 0.0F;
    for (const float part : sums) sum += part;
    right[j] = (right[j] - sum) / column[0];
  }
}

[[gnu::always_inline]] inline void solve_all(const BandLayout& layout, float* matrix,
                                             float* right) {
  factorise(layout, matrix);
  substitute(layout, matrix, right);
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void solve_with_avx2(const BandLayout& layout, float* matrix,
                                             float* right) {
  solve_all(layout, matrix, right);
}
#endif

}  // namespace

void solve_band(const BandLayout& layout, float* matrix, float* right) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return solve_with_avx2(layout, matrix, right);
#endif
  solve_all(layout, matrix, right);
}

}  // namespace understory::landmark_extractor::ground
