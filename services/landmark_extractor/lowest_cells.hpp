// The lowest returns around the sensor, cell by cell.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace understory {

/// A square of cells about the sensor, which covers whole distances between the ground's nodes.
struct LowestCells {
  static constexpr float kNone = std::numeric_limits<float>::infinity();
  static constexpr float kNodeSpacing_m = 4.0F;
  static constexpr float kCell_m = 1.0F;

  float corner_x_m = 0.0F;
  float corner_y_m = 0.0F;
  std::size_t spans = 0;        ///< Node distances per side.
  std::size_t side = 0;         ///< Cells per side.
  std::vector<float> lowest_m;  ///< Row by row in y; kNone = no return.

  void clear(float x_m, float y_m, float reach_m) {
    spans = static_cast<std::size_t>(std::ceil(2.0F * reach_m / kNodeSpacing_m)) + 1;
    side = spans * static_cast<std::size_t>(kNodeSpacing_m / kCell_m);
    corner_x_m = x_m - 0.5F * static_cast<float>(spans) * kNodeSpacing_m;
    corner_y_m = y_m - 0.5F * static_cast<float>(spans) * kNodeSpacing_m;
    lowest_m.assign(side * side, kNone);
  }
  std::size_t index(float x_m, float y_m) const {
    const auto limit = static_cast<float>(side - 1);
    const auto i = static_cast<int>(std::clamp((x_m - corner_x_m) / kCell_m, 0.0F, limit));
    const auto j = static_cast<int>(std::clamp((y_m - corner_y_m) / kCell_m, 0.0F, limit));
    return static_cast<std::size_t>(j) * side + static_cast<std::size_t>(i);
  }
};

}  // namespace understory
