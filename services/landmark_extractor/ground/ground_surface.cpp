#include "services/landmark_extractor/ground/ground_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "services/landmark_extractor/lanes.hpp"

namespace understory::landmark_extractor::ground {
namespace {

/// Weight of a second difference between nodes relative to one cell: ground bends by 0.3 m over the
/// distance of nodes, cells are accurate to 0.1 m.
constexpr float kSmoothness = 0.1F;
/// Keeps the matrix regular in regions without points.
constexpr float kFlatness = 1e-3F;
/// Scales [m] at which cells above the surface lose their weight, iteration by iteration.
constexpr std::array<float, 3> kScales_m{1.0F, 0.4F, 0.2F};
/// Returns within this distance of the surface are ground.
constexpr float kOnGround_m = 0.25F;
/// Roughness: difference between the ground at a point and the returns around it.
constexpr double kRoughness_m = 0.05;
/// Growth of the sigma of the surface's height per metre from the nearest ground returns.
constexpr double kUnknownSlope = 0.12;

/// A cell without returns.
constexpr float kNone = std::numeric_limits<float>::infinity();
using Lanes = std::array<float, kLanes>;

/// The normal equations of several patches side by side: the upper triangle between their four
/// nodes, and the right-hand side.
struct PatchSums {
  std::array<Lanes, 10> square{};
  std::array<Lanes, 4> right{};
};

/// Weight of each of a patch's nodes in the surface at the centre of one of its cells.
constexpr std::array<float, 4> share_of(int plane) {
  constexpr auto kCells = static_cast<float>(points::GroundGrid::kCellsPerSpan);
  const int column = plane % points::GroundGrid::kCellsPerSpan;
  const int row = plane / points::GroundGrid::kCellsPerSpan;
  const float a = (static_cast<float>(column) + 0.5F) / kCells;
  const float b = (static_cast<float>(row) + 0.5F) / kCells;
  return {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
}

/// Adds the cells of one plane; cells above the surface are hardly ground, cells far below are
/// ghosts. Without a scale (0) all have the same weight.
[[gnu::always_inline]] inline void add_plane(const float* lowest, const std::array<Lanes, 4>& nodes,
                                             const std::array<float, 4>& share, float per_scale,
                                             PatchSums& sums) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    const bool is_there = lowest[l] < kNone;
    const float z = is_there ? lowest[l] : 0.0F;
    const float above = z - (share[0] * nodes[0][l] + share[1] * nodes[1][l] +
                             share[2] * nodes[2][l] + share[3] * nodes[3][l]);

    // A cell far from the surface has little weight.
    const float e = above * (above > 0.0F ? per_scale : per_scale * (1.0F / 3.0F));
    const float root = 1.0F / (1.0F + e * e);
    const float w = is_there ? root * root : 0.0F;

    const float w0 = w * share[0];
    const float w1 = w * share[1];
    const float w2 = w * share[2];
    const float w3 = w * share[3];

    sums.square[0][l] += w0 * share[0];
    sums.square[1][l] += w0 * share[1];
    sums.square[2][l] += w0 * share[2];
    sums.square[3][l] += w0 * share[3];
    sums.square[4][l] += w1 * share[1];
    sums.square[5][l] += w1 * share[2];
    sums.square[6][l] += w1 * share[3];
    sums.square[7][l] += w2 * share[2];
    sums.square[8][l] += w2 * share[3];
    sums.square[9][l] += w3 * share[3];

    sums.right[0][l] += w0 * z;
    sums.right[1][l] += w1 * z;
    sums.right[2][l] += w2 * z;
    sums.right[3][l] += w3 * z;
  }
}

[[gnu::always_inline]] inline void add_all_planes(const float* lowest, std::size_t plane,
                                                  const std::array<Lanes, 4>& nodes,
                                                  float per_scale, PatchSums& sums) {
  for (int p = 0; p < points::GroundGrid::kPlanes; ++p) {
    add_plane(lowest + static_cast<std::size_t>(p) * plane, nodes, share_of(p), per_scale, sums);
  }
}

#if defined(__x86_64__)
// Without fused multiplication: the same numbers on every machine.
[[gnu::target("avx2")]] void add_planes_with_avx2(const float* lowest, std::size_t plane,
                                                  const std::array<Lanes, 4>& nodes,
                                                  float per_scale, PatchSums& sums) {
  add_all_planes(lowest, plane, nodes, per_scale, sums);
}
#endif

void add_planes(const float* lowest, std::size_t plane, const std::array<Lanes, 4>& nodes,
                float per_scale, PatchSums& sums) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    return add_planes_with_avx2(lowest, plane, nodes, per_scale, sums);
  }
#endif
  add_all_planes(lowest, plane, nodes, per_scale, sums);
}

}  // namespace

void GroundSurface::fit(const GroundSample& sample) {
  const bool is_same_size = grid_.nodes_per_side == sample.grid().nodes_per_side;
  grid_ = sample.grid();
  const auto side = static_cast<std::size_t>(grid_.nodes_per_side);
  layout_ = BandLayout::of(side * side, 2 * side + 1);
  if (!is_same_size) add_smoothness();

  // Iteratively reweighted least squares: cells above the surface lose their weight.
  find_lowest(sample);
  nodes_.assign(layout_.padded_size(), 0.0F);
  for (std::size_t k = 0; k <= kScales_m.size(); ++k) {
    add_cells(k == 0 ? 0.0F : 1.0F / kScales_m[k - 1]);
    solve_band(layout_, matrix_.data(), nodes_.data());
    // Clears the values written beyond the end by the last columns.
    std::fill(nodes_.begin() + static_cast<std::ptrdiff_t>(layout_.size), nodes_.end(), 0.0F);
  }

  make_patches();
  find_residuals(sample);
}

void GroundSurface::find_lowest(const GroundSample& sample) {
  lowest_.assign(grid_.cells(), kNone);
  float* lowest = lowest_.data();
  const std::span cells = sample.cell();
  const std::span z = sample.z();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    float& here = lowest[cells[i]];
    here = std::min(here, z[i]);
  }
  for (int p = 0; p < points::GroundGrid::kPlanes; ++p)
    lowest[p * grid_.plane + grid_.nowhere()] = kNone;
}

void GroundSurface::find_residuals(const GroundSample& sample) {
  heights_.resize(sample.x().size());
  heights_above(sample.x().data(), sample.y().data(), sample.z().data(), heights_.size(), grid_,
                patches_.data(), heights_.data());
  residuals_.assign(grid_.cells(), {});
  Residual* residuals = residuals_.data();
  const std::span cells = sample.cell();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const bool is_ground = std::abs(heights_[i]) < kOnGround_m;
    Residual& here = residuals[cells[i]];
    here.count += is_ground ? 1.0F : 0.0F;
    here.sum += is_ground ? heights_[i] : 0.0F;
  }
}

void GroundSurface::make_patches() {
  const auto n = static_cast<std::size_t>(grid_.nodes_per_side);
  patches_.assign(n * n, {});
  for (std::size_t k = 0; k + n + 1 < n * n; ++k) {
    const float across_x = nodes_[k + 1] - nodes_[k];
    patches_[k] = {nodes_[k], across_x, nodes_[k + n] - nodes_[k],
                   nodes_[k + n + 1] - nodes_[k + n] - across_x};
  }
}

void GroundSurface::add_smoothness() {
  const auto n = static_cast<std::size_t>(grid_.nodes_per_side);
  smoothness_.assign(layout_.entries(), 0.0F);
  const auto add = [&](std::span<const std::size_t> at, std::span<const float> factors, float w) {
    for (std::size_t a = 0; a < at.size(); ++a) {
      for (std::size_t b = 0; b < at.size(); ++b) {
        if (at[b] <= at[a]) {
          smoothness_[at[b] * layout_.stride + (at[a] - at[b])] += w * factors[a] * factors[b];
        }
      }
    }
  };

  // Second differences along x and y, and the twist.
  constexpr std::array<float, 3> kSecond{1.0F, -2.0F, 1.0F};
  constexpr std::array<float, 4> kTwist{1.0F, -1.0F, -1.0F, 1.0F};
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = j * n + i;
      smoothness_[k * layout_.stride] += kFlatness * kSmoothness;
      if (i + 2 < n) add(std::array{k, k + 1, k + 2}, kSecond, kSmoothness);
      if (j + 2 < n) add(std::array{k, k + n, k + 2 * n}, kSecond, kSmoothness);
      if (i + 1 < n && j + 1 < n) {
        add(std::array{k, k + 1, k + n, k + n + 1}, kTwist, 2.0F * kSmoothness);
      }
    }
  }
}

/// Matrix and right-hand side of the next solution from the last one.
void GroundSurface::add_cells(float per_scale) {
  matrix_ = smoothness_;
  const auto n = static_cast<std::size_t>(grid_.nodes_per_side);
  right_.assign(layout_.padded_size(), 0.0F);
  for (std::size_t first = 0; first + n + 1 < layout_.size; first += kLanes) {
    std::array<Lanes, 4> nodes;
    for (std::size_t l = 0; l < kLanes; ++l) {
      nodes[0][l] = nodes_[first + l];
      nodes[1][l] = nodes_[first + l + 1];
      nodes[2][l] = nodes_[first + l + n];
      nodes[3][l] = nodes_[first + l + n + 1];
    }
    PatchSums sums;
    add_planes(lowest_.data() + first, static_cast<std::size_t>(grid_.plane), nodes, per_scale,
               sums);

    const std::size_t count = std::min(kLanes, layout_.size - n - 1 - first);
    for (std::size_t l = 0; l < count; ++l) {
      const std::size_t k = first + l;
      const std::array<std::size_t, 4> at{k, k + 1, k + n, k + n + 1};
      std::size_t term = 0;
      for (std::size_t c = 0; c < 4; ++c) {
        right_[at[c]] += sums.right[c][l];
        for (std::size_t d = c; d < 4; ++d) {
          matrix_[at[c] * layout_.stride + (at[d] - at[c])] += sums.square[term++][l];
        }
      }
    }
  }
  std::swap(nodes_, right_);
}

float GroundSurface::height(float x, float y) const {
  const float u = grid_.place(x, grid_.corner_x_m);
  const float v = grid_.place(y, grid_.corner_y_m);
  const int i = static_cast<int>(u);
  const int j = static_cast<int>(v);
  const float a = u - static_cast<float>(i);
  const float b = v - static_cast<float>(j);
  const int node = j * grid_.nodes_per_side + i;
  const points::GroundPatch& patch = patches_[static_cast<std::size_t>(node)];
  return patch.constant + a * patch.along_x + b * (patch.along_y + a * patch.twist);
}

GroundHeight GroundSurface::below(const Eigen::Vector2d& place_m) const {
  const auto x = static_cast<float>(place_m.x());
  const auto y = static_cast<float>(place_m.y());
  GroundHeight ground{height(x, y), 0.0};
  constexpr auto kCells = static_cast<float>(points::GroundGrid::kCellsPerSpan);
  const int column = static_cast<int>(kCells * grid_.place(x, grid_.corner_x_m));
  const int row = static_cast<int>(kCells * grid_.place(y, grid_.corner_y_m));
  const int side = grid_.cells_per_side();

  // Searches rings of cells outwards until one has ground returns.
  for (int reach = 1; reach <= 8; ++reach) {
    double sum = 0.0;
    double cells = 0.0;
    for (int j = std::max(0, row - reach); j <= std::min(side - 1, row + reach); ++j) {
      for (int i = std::max(0, column - reach); i <= std::min(side - 1, column + reach); ++i) {
        const Residual& residual = residuals_[static_cast<std::size_t>(grid_.cell(i, j))];
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

}  // namespace understory::landmark_extractor::ground
