// The height of the ground around the vehicle, also where grass, trunks or distance hide it.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

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
  /// Fits the surface to the points around `centre_m` and writes every point's height_m.
  void fit(std::span<RingPoint> points, const Eigen::Vector2f& centre_m, float reach_m);

  /// Of the surface [m].
  float height(float x, float y) const {
    const float u = std::clamp((x - corner_x_) / kNodeSpacing_m, 0.0F, node_limit_);
    const float v = std::clamp((y - corner_y_) / kNodeSpacing_m, 0.0F, node_limit_);
    const int i = static_cast<int>(u);
    const int j = static_cast<int>(v);
    const float a = u - static_cast<float>(i);
    const float b = v - static_cast<float>(j);
    const float* low =
        &nodes_[static_cast<std::size_t>(j) * nodes_per_side_ + static_cast<std::size_t>(i)];
    const float* high = low + nodes_per_side_;
    return (1.0F - b) * ((1.0F - a) * low[0] + a * low[1]) +
           b * ((1.0F - a) * high[0] + a * high[1]);
  }
  /// The surface, moved to the ground returns near by; sigma grows where there are none.
  GroundHeight below(const Eigen::Vector2d& place_m) const;

 private:
  static constexpr float kNodeSpacing_m = 4.0F;
  static constexpr float kCell_m = 1.0F;

  /// Returns on the ground in one cell: number and sum of their heights above the surface.
  struct Residual {
    float count = 0.0F;
    float sum = 0.0F;
  };

  void collect_lowest(std::span<const RingPoint> points);
  void add_smoothness();
  void add_cells(float scale_m, bool weigh);
  void solve();
  std::size_t cell(float x, float y) const;

  float corner_x_ = 0.0F;
  float corner_y_ = 0.0F;
  float node_limit_ = 0.0F;
  std::size_t nodes_per_side_ = 0;
  std::size_t cells_per_side_ = 0;
  std::size_t band_ = 0;
  std::vector<float> nodes_;
  std::vector<float> lowest_;  ///< Per cell; infinity = no return.
  std::vector<Residual> residuals_;
  std::vector<float> smoothness_;  ///< Lower band of the normal matrix, by columns.
  std::vector<float> matrix_;
  std::vector<float> right_;
};

}  // namespace understory
