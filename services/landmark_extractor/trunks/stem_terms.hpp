// Residuals of many beams at once relative to a stem, and their sums.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "services/landmark_extractor/lanes.hpp"

namespace understory::landmark_extractor::trunks {

/// Of a stem: x, y, radius, and their changes per metre of height.
using Vector6d = Eigen::Matrix<double, 6, 1>;
/// Information or covariance of a Vector6d.
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// One value for each of several beams.
using Lanes = std::array<float, kLanes>;

/// Beams that hit a stem, in the plan relative to an anchor. As many as one vector register holds.
struct alignas(32) HitLanes {
  Lanes origin_x{};  ///< Position of the sensor.
  Lanes origin_y{};
  Lanes along_x{};  ///< Direction of the beam, unit.
  Lanes along_y{};
  Lanes range{};   ///< In the plan [m].
  Lanes z{};       ///< Height, frame `vehicle_level` [m].
  Lanes counts{};  ///< 1, or 0 if there is no beam.
};

/// Lines of sight that just pass the stem.
struct alignas(32) EdgeLanes {
  Lanes origin_x{};
  Lanes origin_y{};
  Lanes along_x{};
  Lanes along_y{};
  Lanes z{};
  Lanes side{};      ///< +1 = left, -1 = right.
  Lanes variance{};  ///< Of its distance from the edge [m^2].
  Lanes surplus{};  ///< Share by which the common error of all edges is smaller than that variance.
  Lanes counts{};   ///< 1, or 0 if there is none.
};

/// A stem relative to the same anchor: x, y, radius at the reference height, and their changes per
/// metre.
struct StemState {
  std::array<float, 6> values{};
  float reference_z_m = 0.0F;  ///< Frame `vehicle_level`.
};

/// Noise of one beam.
struct BeamNoise {
  float range_variance = 0.0F;  ///< Of the sensor and of the bark [m^2].
  float beam_width_rad = 0.0F;  ///< Half its footprint: widens an object by this on each side.
};

/// Sums of the normal equations, times the height above the reference to the power of 0, 1, 2.
struct StemSums {
  /// The upper triangle of the information of (x, y, radius), row by row, then the gradient.
  static constexpr std::size_t kTerms = 9;
  std::array<std::array<Lanes, kTerms>, 3> powers{};
  Lanes squared{};  ///< Residuals in their standard deviations.

  /// Both sides of the normal equations.
  void normal_equations(Matrix6d& information, Vector6d& gradient) const;
  /// Of all residuals, in their standard deviations.
  double sum_of_squares() const;
};

/// Adds hits and edges; residuals beyond two standard deviations have less weight (Huber).
void add_terms(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
               const StemState& stem, const BeamNoise& noise, StemSums& sums);

/// Adds the correction of the information for hits with reduced weights t / variance (t < 1 for
/// grazing hits) and for edges: (t - t^2) / variance, since the estimate's spread is that of t^2 /
/// variance.
void add_unused(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
                const StemState& stem, const BeamNoise& noise, StemSums& sums);

/// Mean squared residual of each group of hits, and the squared residuals of the edges, in their
/// standard deviations.
void square_terms(std::span<const HitLanes> hits, std::span<const EdgeLanes> edges,
                  const StemState& stem, const BeamNoise& noise, std::span<float> hit_means,
                  std::span<Lanes> edge_squares);

/// Solves information * change = gradient; false if the matrix is not positive definite.
bool solve_normal(const Matrix6d& information, const Vector6d& gradient, Vector6d& change);

}  // namespace understory::landmark_extractor::trunks
