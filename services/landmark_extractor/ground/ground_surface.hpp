// The height of the ground around the vehicle, also under grass, behind trunks and far away.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/landmark_extractor/ground/band_solver.hpp"
#include "services/landmark_extractor/ground/ground_sample.hpp"

namespace understory::landmark_extractor::ground {

/// Ground below one point of the plan.
struct GroundHeight {
  double height_m = 0.0;  ///< z in `vehicle_level`.
  double sigma_m = 0.0;   ///< Of height_m.
};

/// A smooth surface (bilinear between nodes, second differences penalised) under the lowest returns
/// of small cells. Returns above it are trunks and bushes and lose their weight step by step.
/// Reuses memory between sweeps, but has no state.
class GroundSurface {
 public:
  /// Fits the surface: four linear solutions with a band matrix, about 0.5 ms.
  void fit(const GroundSample& sample);

  /// The grid of nodes and cells.
  const points::GroundGrid& grid() const { return grid_; }
  /// One per node: height [m] between it and the next ones.
  const points::GroundPatch* patches() const { return patches_.data(); }
  /// The ground below a point of the plan, frame `vehicle_level`: the surface, corrected by the
  /// ground returns near by; sigma grows with the distance to them.
  GroundHeight below(const Eigen::Vector2d& place_m) const;

 private:
  /// Returns on the ground in one cell: number and sum of their heights above the surface.
  struct Residual {
    float count = 0.0F;
    float sum = 0.0F;
  };

  void find_lowest(const GroundSample& sample);
  void find_residuals(const GroundSample& sample);
  void make_patches();
  void add_smoothness();
  void add_cells(float per_scale);
  float height(float x, float y) const;

  points::GroundGrid grid_;
  BandLayout layout_;
  std::vector<float> lowest_;  ///< Per cell.
  std::vector<float> nodes_;   ///< Padded.
  std::vector<points::GroundPatch> patches_;
  std::vector<Residual> residuals_;  ///< Per cell.
  std::vector<float> heights_;       ///< Of the sample, above the surface.
  std::vector<float> smoothness_;    ///< Lower band of the normal matrix.
  std::vector<float> matrix_;
  std::vector<float> right_;
};

}  // namespace understory::landmark_extractor::ground
