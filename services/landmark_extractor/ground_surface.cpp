#include "services/landmark_extractor/ground_surface.hpp"

#include <array>

namespace understory {
namespace {

/// Weight of a second difference between nodes against one cell: ground bends by 0.3 m over a
/// node's distance where cells lie within 0.1 m.
constexpr float kSmoothness = 0.1F;
/// Keeps the matrix regular where there are no points at all.
constexpr float kFlatness = 1e-3F;
/// Scales [m] at which cells above the surface lose their weight, iteration by iteration.
constexpr std::array<float, 3> kScales_m{1.0F, 0.4F, 0.2F};
/// Returns so near the surface are ground.
constexpr float kOnGround_m = 0.25F;
/// Roughness: how far the ground at one place is from the returns around it.
constexpr double kRoughness_m = 0.05;
/// How much the surface's own height is unknown per metre from the nearest ground returns.
constexpr double kUnknownSlope = 0.12;

/// Cells above the surface are hardly ground; cells far below are ghosts.
float weight(float above_m, float scale_m) {
  const float e = above_m > 0.0F ? above_m / scale_m : above_m / (3.0F * scale_m);
  const float w = 1.0F / (1.0F + e * e);
  return w * w;
}

/// Cholesky factor of a banded matrix in place: column by column, each updates those after it.
[[gnu::always_inline]] inline void factorise_columns(float* matrix, std::size_t n,
                                                     std::size_t band) {
  for (std::size_t j = 0; j < n; ++j) {
    float* column = matrix + j * band;
    const std::size_t reach = std::min(band, n - j);
    const float scale = 1.0F / std::sqrt(std::max(column[0], 1e-9F));
    for (std::size_t k = 0; k < reach; ++k) column[k] *= scale;
    for (std::size_t k = 1; k < reach; ++k) {
      float* __restrict__ other = matrix + (j + k) * band;
      const float* __restrict__ from = column + k;
      const float factor = column[k];
      for (std::size_t t = 0; t < reach - k; ++t) other[t] -= factor * from[t];
    }
  }
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void factorise_with_avx2(float* matrix, std::size_t n, std::size_t band) {
  factorise_columns(matrix, n, band);
}
#endif

void factorise(float* matrix, std::size_t n, std::size_t band) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return factorise_with_avx2(matrix, n, band);
#endif
  factorise_columns(matrix, n, band);
}

}  // namespace

void GroundSurface::fit(const LowestCells& cells) {
  const bool is_same_size = nodes_per_side_ == cells.spans + 1;
  nodes_per_side_ = cells.spans + 1;
  cells_per_side_ = cells.side;
  grid_ = {cells.corner_x_m, cells.corner_y_m, static_cast<float>(cells.spans) - 1e-3F,
           static_cast<int>(nodes_per_side_), static_cast<int>(cells_per_side_)};
  band_ = 2 * nodes_per_side_ + 1;
  nodes_.assign(nodes_per_side_ * nodes_per_side_, 0.0F);
  if (!is_same_size) add_smoothness();
  for (std::size_t k = 0; k <= kScales_m.size(); ++k) {
    add_cells(cells, k == 0 ? 1.0F : kScales_m[k - 1], k > 0);
    solve();
  }
  make_patches();
  residuals_.assign(cells.lowest_m.size(), {});
}

void GroundSurface::make_patches() {
  const std::size_t n = nodes_per_side_;
  patches_.resize(n * n);
  for (std::size_t k = 0; k + n + 1 < n * n; ++k) {
    const float across_x = nodes_[k + 1] - nodes_[k];
    patches_[k] = {nodes_[k], across_x, nodes_[k + n] - nodes_[k],
                   nodes_[k + n + 1] - nodes_[k + n] - across_x};
  }
}

void GroundSurface::measure(std::span<RingPoint> points) {
  // Copies, which no write to a point can change.
  const Grid grid = grid_;
  const Patch* patches = patches_.data();
  Residual* residuals = residuals_.data();
  // Neighbours in a ring share their cell: their sum is kept at hand.
  int cell_at_hand = 0;
  Residual at_hand;
  const auto put_away = [&] {
    residuals[cell_at_hand].count += at_hand.count;
    residuals[cell_at_hand].sum += at_hand.sum;
  };
  for (RingPoint& point : points) {
    const Place place = grid.locate(point.x_m, point.y_m);
    const float above = point.z_m - height(patches, grid, place);
    point.height_m = above;
    if (std::abs(above) >= kOnGround_m) continue;
    const int here = grid.cell(place);
    if (here != cell_at_hand) {
      put_away();
      at_hand = {};
      cell_at_hand = here;
    }
    at_hand.count += 1.0F;
    at_hand.sum += above;
  }
  put_away();
}

void GroundSurface::add_smoothness() {
  const std::size_t n = nodes_per_side_;
  smoothness_.assign(n * n * band_, 0.0F);
  const auto add = [&](std::span<const std::size_t> at, std::span<const float> factors, float w) {
    for (std::size_t a = 0; a < at.size(); ++a) {
      for (std::size_t b = 0; b < at.size(); ++b) {
        if (at[b] <= at[a]) {
          smoothness_[at[b] * band_ + (at[a] - at[b])] += w * factors[a] * factors[b];
        }
      }
    }
  };
  constexpr std::array<float, 3> kSecond{1.0F, -2.0F, 1.0F};
  constexpr std::array<float, 4> kTwist{1.0F, -1.0F, -1.0F, 1.0F};
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = j * n + i;
      smoothness_[k * band_] += kFlatness * kSmoothness;
      if (i + 2 < n) add(std::array{k, k + 1, k + 2}, kSecond, kSmoothness);
      if (j + 2 < n) add(std::array{k, k + n, k + 2 * n}, kSecond, kSmoothness);
      if (i + 1 < n && j + 1 < n) {
        add(std::array{k, k + 1, k + n, k + n + 1}, kTwist, 2.0F * kSmoothness);
      }
    }
  }
}

void GroundSurface::add_cells(const LowestCells& cells, float scale_m, bool weigh) {
  matrix_ = smoothness_;
  right_.assign(nodes_.size(), 0.0F);
  for (std::size_t j = 0; j < cells_per_side_; ++j) {
    for (std::size_t i = 0; i < cells_per_side_; ++i) {
      const float z = cells.lowest_m[j * cells_per_side_ + i];
      if (z == LowestCells::kNone) continue;
      const float u = (static_cast<float>(i) + 0.5F) * kCell_m / kNodeSpacing_m;
      const float v = (static_cast<float>(j) + 0.5F) * kCell_m / kNodeSpacing_m;
      const auto node_i = static_cast<std::size_t>(u);
      const auto node_j = static_cast<std::size_t>(v);
      const float a = u - static_cast<float>(node_i);
      const float b = v - static_cast<float>(node_j);
      const std::size_t k = node_j * nodes_per_side_ + node_i;
      const std::array<std::size_t, 4> at{k, k + 1, k + nodes_per_side_, k + nodes_per_side_ + 1};
      const std::array<float, 4> share{(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
      float surface = 0.0F;
      for (std::size_t c = 0; c < 4; ++c) surface += share[c] * nodes_[at[c]];
      const float w = weigh ? weight(z - surface, scale_m) : 1.0F;
      for (std::size_t c = 0; c < 4; ++c) {
        right_[at[c]] += w * share[c] * z;
        for (std::size_t d = 0; d <= c; ++d) {
          matrix_[at[d] * band_ + (at[c] - at[d])] += w * share[c] * share[d];
        }
      }
    }
  }
}

/// Both substitutions follow the factor.
void GroundSurface::solve() {
  const std::size_t n = nodes_.size();
  factorise(matrix_.data(), n, band_);
  nodes_ = right_;
  float* __restrict__ nodes = nodes_.data();
  const float* __restrict__ matrix = matrix_.data();
  for (std::size_t j = 0; j < n; ++j) {
    const float* column = matrix + j * band_;
    const std::size_t reach = std::min(band_, n - j);
    const float node = nodes[j] / column[0];
    nodes[j] = node;
    for (std::size_t k = 1; k < reach; ++k) nodes[j + k] -= column[k] * node;
  }
  for (std::size_t j = n; j-- > 0;) {
    const float* column = matrix + j * band_;
    const std::size_t reach = std::min(band_, n - j);
    // Several sums side by side: one would wait for itself.
    std::array<float, 4> sums{};
    std::size_t k = 1;
    for (; k + sums.size() <= reach; k += sums.size()) {
      for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += column[k + s] * nodes[j + k + s];
    }
    for (; k < reach; ++k) sums[0] += column[k] * nodes[j + k];
    nodes[j] = (nodes[j] - ((sums[0] + sums[1]) + (sums[2] + sums[3]))) / column[0];
  }
}

GroundHeight GroundSurface::below(const Eigen::Vector2d& place_m) const {
  const auto x = static_cast<float>(place_m.x());
  const auto y = static_cast<float>(place_m.y());
  GroundHeight ground{height(x, y), 0.0};
  const auto middle = static_cast<std::size_t>(grid_.cell(grid_.locate(x, y)));
  const auto row = static_cast<std::ptrdiff_t>(middle / cells_per_side_);
  const auto column = static_cast<std::ptrdiff_t>(middle % cells_per_side_);
  const auto side = static_cast<std::ptrdiff_t>(cells_per_side_);
  // Ring of cells by ring of cells outwards until one has seen the ground.
  for (std::ptrdiff_t reach = 1; reach <= 8; ++reach) {
    double sum = 0.0;
    double cells = 0.0;
    for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, row - reach);
         j <= std::min(side - 1, row + reach); ++j) {
      for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, column - reach);
           i <= std::min(side - 1, column + reach); ++i) {
        const Residual& residual = residuals_[static_cast<std::size_t>(j * side + i)];
        if (residual.count < 1.0F) continue;
        sum += residual.sum / residual.count;
        cells += 1.0;
      }
    }
    if (cells >= 2.0) {
      ground.height_m += sum / cells;
      ground.sigma_m = std::hypot(kRoughness_m, kUnknownSlope * static_cast<double>(reach));
      return ground;
    }
  }
  ground.sigma_m = std::hypot(kRoughness_m, kUnknownSlope * 10.0);
  return ground;
}

}  // namespace understory
