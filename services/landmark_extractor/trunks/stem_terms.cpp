#include "services/landmark_extractor/trunks/stem_terms.hpp"

#include <algorithm>
#include <cmath>

namespace understory::landmark_extractor::trunks {
namespace {

/// Beyond this share of the radius the range changes too steeply for its derivative.
constexpr float kMaxGraze = 0.98F;
/// Residuals beyond this many sigma are weighted as at this limit (Huber).
constexpr float kHuber = 2.0F;

/// Residuals with their derivatives by (x, y, radius) at their own heights.
struct Terms {
  Lanes above;
  Lanes residual;
  Lanes by_x;
  Lanes by_y;
  Lanes by_radius;
  Lanes weight;  ///< 1 / variance, reduced for a grazing beam.
  Lanes fade;    ///< That reduction.
};

/// Intersections of beams with the stem.
[[gnu::always_inline]] inline void take_hits(const HitLanes& hits, const StemState& stem,
                                             const BeamNoise& noise, Terms& terms) {
  const std::array<float, 6> s = stem.values;
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float above = hits.z[l] - stem.reference_z_m;
    const float radius = std::max(s[2] + above * s[5], 1e-3F);

    const float dx = hits.along_x[l];
    const float dy = hits.along_y[l];
    const float to_x = s[0] + above * s[3] - hits.origin_x[l];
    const float to_y = s[1] + above * s[4] - hits.origin_y[l];
    const float along = dx * to_x + dy * to_y;
    const float miss = dx * to_y - dy * to_x;

    // The limit keeps the root real if a beam misses the stem.
    const float limit = kMaxGraze * radius;
    const float m = std::min(std::max(miss, -limit), limit);
    const float square = radius * radius - m * m;
    const float inverse = 1.0F / std::sqrt(square);
    const float tangent = m * inverse;

    // The width of the footprint on a slanting surface blurs the range.
    const float smear = tangent * along * noise.beam_width_rad;
    const float variance = noise.range_variance + smear * smear;

    // Residuals are measured across the bark. At grazing incidence only the edge itself is
    // informative; and beams that alternate between hit and miss during the iteration would pull
    // the edge inwards.
    const float share = miss / radius;
    const float fade = std::max(1.0F - share * share, 0.0F);

    terms.above[l] = above;
    // The half chord is square / its root.
    terms.residual[l] = hits.range[l] - along + square * inverse;
    terms.by_x[l] = dx - tangent * dy;
    terms.by_y[l] = dy + tangent * dx;
    terms.by_radius[l] = -radius * inverse;
    terms.fade[l] = fade * hits.counts[l];
    terms.weight[l] = terms.fade[l] / variance;
  }
}

/// Distances of lines of sight from the stem on their own side.
[[gnu::always_inline]] inline void take_edges(const EdgeLanes& edges, const StemState& stem,
                                              Terms& terms) {
  const std::array<float, 6> s = stem.values;
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float above = edges.z[l] - stem.reference_z_m;
    const float to_x = s[0] + above * s[3] - edges.origin_x[l];
    const float to_y = s[1] + above * s[4] - edges.origin_y[l];
    const float radius = s[2] + above * s[5];
    terms.above[l] = above;
    terms.residual[l] =
        -(edges.along_x[l] * to_y - edges.along_y[l] * to_x + edges.side[l] * radius);
    terms.by_x[l] = -edges.along_y[l];
    terms.by_y[l] = edges.along_x[l];
    terms.by_radius[l] = edges.side[l];
    terms.weight[l] = edges.counts[l] / edges.variance[l];
  }
}

[[gnu::always_inline]] inline void add(const Terms& terms, StemSums& sums) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float residual = terms.residual[l];
    const float squared = residual * residual * terms.weight[l];
    sums.squared[l] += squared;
    const float tame = kHuber / std::sqrt(std::max(squared, kHuber * kHuber));
    const float weight = terms.weight[l] * tame;
    const float x = terms.by_x[l];
    const float y = terms.by_y[l];
    const float r = terms.by_radius[l];
    const float wx = weight * x;
    const float wy = weight * y;
    const float wr = weight * r;
    const std::array<float, StemSums::kTerms> all{wx * x,        wx * y,        wx * r,
                                                  wy * y,        wy * r,        wr * r,
                                                  wx * residual, wy * residual, wr * residual};
    const float above = terms.above[l];
    for (std::size_t i = 0; i < StemSums::kTerms; ++i) {
      sums.powers[0][i][l] += all[i];
      sums.powers[1][i][l] += above * all[i];
      sums.powers[2][i][l] += above * above * all[i];
    }
  }
}

[[gnu::always_inline]] inline void add_all(std::span<const HitLanes> hits,
                                           std::span<const EdgeLanes> edges, const StemState& stem,
                                           const BeamNoise& noise, StemSums& sums) {
  Terms terms;
  for (const HitLanes& group : hits) {
    take_hits(group, stem, noise, terms);
    add(terms, sums);
  }
  for (const EdgeLanes& group : edges) {
    take_edges(group, stem, terms);
    add(terms, sums);
  }
}

[[gnu::always_inline]] inline void square_all(std::span<const HitLanes> hits,
                                              std::span<const EdgeLanes> edges,
                                              const StemState& stem, const BeamNoise& noise,
                                              std::span<float> hit_means,
                                              std::span<Lanes> edge_squares) {
  Terms terms;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    take_hits(hits[i], stem, noise, terms);
    float sum = 0.0F;
    float count = 0.0F;
    for (std::size_t l = 0; l < kLanes; ++l) {
      sum += terms.residual[l] * terms.residual[l] * terms.weight[l];
      count += terms.fade[l];
    }
    hit_means[i] = sum / std::max(count, 1e-3F);
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    take_edges(edges[i], stem, terms);
    for (std::size_t l = 0; l < kLanes; ++l) {
      edge_squares[i][l] = terms.residual[l] * terms.residual[l] * terms.weight[l];
    }
  }
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void add_with_avx2(std::span<const HitLanes> hits,
                                           std::span<const EdgeLanes> edges, const StemState& stem,
                                           const BeamNoise& noise, StemSums& sums) {
  add_all(hits, edges, stem, noise, sums);
}
[[gnu::target("avx2")]] void square_with_avx2(std::span<const HitLanes> hits,
                                              std::span<const EdgeLanes> edges,
                                              const StemState& stem, const BeamNoise& noise,
                                              std::span<float> hit_means,
                                              std::span<Lanes> edge_squares) {
  square_all(hits, edges, stem, noise, hit_means, edge_squares);
}
#endif

double sum_of(const Lanes& lanes) {
  const float first = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
  const float second = (lanes[4] + lanes[5]) + (lanes[6] + lanes[7]);
  return static_cast<double>(first + second);
}

}  // namespace

void StemSums::normal_equations(Matrix6d& information, Vector6d& gradient) const {
  std::array<std::array<double, kTerms>, 3> s{};
  for (std::size_t p = 0; p < 3; ++p) {
    for (std::size_t i = 0; i < kTerms; ++i) s[p][i] = sum_of(powers[p][i]);
  }
  const auto block = [&](std::size_t p) {
    Eigen::Matrix3d result;
    result << s[p][0], s[p][1], s[p][2], s[p][1], s[p][3], s[p][4], s[p][2], s[p][4], s[p][5];
    return result;
  };
  information.topLeftCorner<3, 3>() = block(0);
  information.topRightCorner<3, 3>() = block(1);
  information.bottomLeftCorner<3, 3>() = block(1);
  information.bottomRightCorner<3, 3>() = block(2);
  for (int i = 0; i < 3; ++i) {
    gradient[i] = s[0][6 + static_cast<std::size_t>(i)];
    gradient[i + 3] = s[1][6 + static_cast<std::size_t>(i)];
  }
}

double StemSums::sum_of_squares() const { return sum_of(squared); }

void add_terms(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
               const StemState& stem, const BeamNoise& noise, StemSums& sums) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return add_with_avx2(hits, edges, stem, noise, sums);
#endif
  add_all(hits, edges, stem, noise, sums);
}

void add_unused(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
                const StemState& stem, const BeamNoise& noise, StemSums& sums) {
  Terms terms;
  for (const HitLanes& group : hits) {
    take_hits(group, stem, noise, terms);
    for (std::size_t l = 0; l < kLanes; ++l) terms.weight[l] *= 1.0F - terms.fade[l];
    add(terms, sums);
  }
  for (const EdgeLanes& group : edges) {
    take_edges(group, stem, terms);
    for (std::size_t l = 0; l < kLanes; ++l) terms.weight[l] *= group.surplus[l];
    add(terms, sums);
  }
}

void square_terms(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
                  const StemState& stem, const BeamNoise& noise, std::span<float> hit_means,
                  std::span<Lanes> edge_squares) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    return square_with_avx2(hits, edges, stem, noise, hit_means, edge_squares);
  }
#endif
  square_all(hits, edges, stem, noise, hit_means, edge_squares);
}

/// Cholesky, with loop bounds known to the compiler.
bool solve_normal(const Matrix6d& information, const Vector6d& gradient, Vector6d& change) {
  constexpr int kSize = 6;
  Matrix6d factor = Matrix6d::Zero();

  // The diagonal of the factor holds inverses.
  for (int j = 0; j < kSize; ++j) {
    double pivot = information(j, j);
    for (int k = 0; k < j; ++k) pivot -= factor(j, k) * factor(j, k);
    if (!(pivot > 0.0)) return false;

    const double inverse = 1.0 / std::sqrt(pivot);
    factor(j, j) = inverse;

    for (int i = j + 1; i < kSize; ++i) {
      double value = information(i, j);
      for (int k = 0; k < j; ++k) value -= factor(i, k) * factor(j, k);
      factor(i, j) = value * inverse;
    }
  }

  // The first pass solves with the factor, the second with its transpose.
  change = gradient;
  for (int j = 0; j < kSize; ++j) {
    for (int k = 0; k < j; ++k) change[j] -= factor(j, k) * change[k];
    change[j] *= factor(j, j);
  }

  for (int j = kSize - 1; j >= 0; --j) {
    for (int k = j + 1; k < kSize; ++k) change[j] -= factor(k, j) * change[k];
    change[j] *= factor(j, j);
  }
  return true;
}

}  // namespace understory::landmark_extractor::trunks
