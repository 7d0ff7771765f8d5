// The height of the ground around the vehicle, also where grass, trunks or distance hide it.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "services/landmark_extractor/lowest_cells.hpp"
#include "services/landmark_extractor/ring_cloud.hpp"

namespace understory {

/// Ground below one place.
struct GroundHeight {
  double height_m = 0.0;  ///< z in `vehicle_level`.
  double sigma_m = 0.0;
};

/// A smooth surface (bilinear between nodes, second differences penalised) under the lowest returns
/// of small cells. Returns above it are trunks and bushes and lose their weight step by step.
class GroundSurface {
 public:
  /// Fits the surface to the lowest returns. Forgets what was measured.
  void fit(const LowestCells& cells);
  /// Writes the points' height_m, and keeps those on the ground for below().
  void measure(std::span<RingPoint> points);

  /// Of the surface [m].
  float height(float x, float y) const {
    return height(patches_.data(), grid_, grid_.locate(x, y));
  }
  /// The surface, moved to the ground returns near by; sigma grows where there are none.
  GroundHeight below(const Eigen::Vector2d& place_m) const;

 private:
  static constexpr float kNodeSpacing_m = LowestCells::kNodeSpacing_m;
  static constexpr float kCell_m = LowestCells::kCell_m;

  /// Returns on the ground in one cell: number and sum of their heights above the surface.
  struct Residual {
    float count = 0.0F;
    float sum = 0.0F;
  };

  /// The surface between four nodes, from the one at its low corner.
  struct Patch {
    float constant = 0.0F;
    float along_x = 0.0F;
    float along_y = 0.0F;
    float twist = 0.0F;
  };

  /// A place in node distances from the corner, within the square.
  struct Place {
    float u = 0.0F;
    float v = 0.0F;
  };
  /// Where nodes and cells are.
  struct Grid {
    float corner_x = 0.0F;
    float corner_y = 0.0F;
    float node_limit = 0.0F;
    int nodes_per_side = 0;
    int cells_per_side = 0;

    Place locate(float x, float y) const {
      return {within((x - corner_x) * (1.0F / kNodeSpacing_m)),
              within((y - corner_y) * (1.0F / kNodeSpacing_m))};
    }
    float within(float value) const {
      const float positive = value > 0.0F ? value : 0.0F;
      return positive < node_limit ? positive : node_limit;
    }
    int cell(const Place& place) const {
      constexpr float kCells = kNodeSpacing_m / kCell_m;
      return static_cast<int>(place.v * kCells) * cells_per_side +
             static_cast<int>(place.u * kCells);
    }
  };

  static float height(const Patch* patches, const Grid& grid, const Place& place) {
    const int i = static_cast<int>(place.u);
    const int j = static_cast<int>(place.v);
    const float a = place.u - static_cast<float>(i);
    const float b = place.v - static_cast<float>(j);
    const Patch& patch = patches[j * grid.nodes_per_side + i];
    return patch.constant + a * patch.along_x + b * (patch.along_y + a * patch.twist);
  }
  void make_patches();
  void add_smoothness();
  void add_cells(const LowestCells& cells, float scale_m, bool weigh);
  void solve();

  Grid grid_;
  std::size_t nodes_per_side_ = 0;
  std::size_t cells_per_side_ = 0;
  std::size_t band_ = 0;
  std::vector<float> nodes_;
  std::vector<Patch> patches_;  ///< Per node; those of the last row and column are not used.
  std::vector<Residual> residuals_;
  std::vector<float> smoothness_;  ///< Lower band of the normal matrix, by columns.
  std::vector<float> matrix_;
  std::vector<float> right_;
};

}  // namespace understory
