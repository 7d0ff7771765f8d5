// Geometry of the ground surface's nodes and cells, and its height between the nodes.
#pragma once

#include <cmath>
#include <cstddef>

namespace understory::landmark_extractor::points {

/// The surface between four nodes, relative to its low corner.
struct GroundPatch {
  float constant = 0.0F;  ///< Height at the low corner [m].
  float along_x = 0.0F;   ///< Rise to the next node along x [m].
  float along_y = 0.0F;   ///< Rise to the next node along y [m].
  float twist = 0.0F;     ///< Rise along x of the rise along y [m].
};

/// A square around the sensor. A node every 4 m; each node is the low corner of a patch of 4 x 4
/// cells. The patches of the last row and column lie outside and are never occupied.
///
/// Cells are stored plane by plane: first the low corner cell of every patch, then the next one of
/// every patch, so several patches are summed at once.
struct GroundGrid {
  static constexpr float kSpacing_m = 4.0F;                      ///< From node to node.
  static constexpr int kCellsPerSpan = 4;                        ///< Along one side of a patch.
  static constexpr int kPlanes = kCellsPerSpan * kCellsPerSpan;  ///< Cells of a patch.

  float corner_x_m = 0.0F;  ///< Low corner, frame `vehicle_level`.
  float corner_y_m = 0.0F;
  float limit = 0.0F;  ///< Upper limit of coordinates in node distances (exclusive).
  int nodes_per_side = 0;
  int plane = 0;  ///< Cells from plane to plane; a whole number of vector registers.

  /// The grid that covers `reach_m` around the point, with whole distances between nodes.
  static GroundGrid around(float x_m, float y_m, float reach_m) {
    const int spans = static_cast<int>(std::ceil(2.0F * reach_m / kSpacing_m)) + 1;
    const float half = 0.5F * static_cast<float>(spans) * kSpacing_m;
    const int nodes = spans + 1;
    constexpr int kLanes = 8;
    return {x_m - half, y_m - half, static_cast<float>(spans) - 1e-3F, nodes,
            (nodes * nodes + kLanes) / kLanes * kLanes};
  }
  int nodes() const { return nodes_per_side * nodes_per_side; }  ///< Of the whole square.
  /// Of the whole square.
  int cells_per_side() const { return (nodes_per_side - 1) * kCellsPerSpan; }
  /// Of all planes, including unused cells between the planes.
  std::size_t cells() const { return static_cast<std::size_t>(plane) * kPlanes; }
  /// A cell outside the grid.
  int nowhere() const { return plane - 1; }

  /// A coordinate in node distances from the corner, within the square; 0 for NaN.
  float place(float coordinate_m, float corner_m) const {
    const float value = (coordinate_m - corner_m) * (1.0F / kSpacing_m);
    const float positive = value > 0.0F ? value : 0.0F;
    return positive < limit ? positive : limit;
  }
  /// Index of the cell in column `i` and row `j` of the whole square.
  int cell(int i, int j) const {
    const int patch = (j / kCellsPerSpan) * nodes_per_side + i / kCellsPerSpan;
    return ((j % kCellsPerSpan) * kCellsPerSpan + i % kCellsPerSpan) * plane + patch;
  }
};

}  // namespace understory::landmark_extractor::points
