// GLAROT-3D: relative positions of a frame's landmarks in space, for any orientation.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/place_recognition/detectors/linear_detector.hpp"

namespace understory::place_recognition::detectors {

/// Rizzini 2017 (thesis 002 §2.4.1). The direction of every ordered pair of landmarks falls on a
/// face of a cube (eq. 2.26: the nearest axis; the thesis prints argmin for outward normals) and
/// there in a cell of an l x l grid of equal angles, u = l (2/pi atan(u.r / d.r) + 1/2), v likewise
/// (eqs. 2.27 and 2.28, whose brackets are misplaced); its length falls in a bin of range. Counts
/// are divided by the number of pairs. Two histograms differ by the least L1 norm under the 24
/// rotations that map the cube to itself (eq. 2.29): other rotations are covered only by the size
/// of the cells.
class Glarot3dSignature {
 public:
  /// Precondition: at least one cell and one bin, a step > 0.
  Glarot3dSignature(const Glarot3dParameters& parameters, double place_sigma_m);

  /// Numbers of a row: bins of range for each cell of the six faces.
  std::size_t length() const { return cells() * parameters_.range_bins; }
  /// O(pairs). False with fewer than two landmarks in reach of each other.
  bool describe(const PlaceFrame& frame, std::span<float> row) const;
  /// Rotated L1 norm; O(24 bins).
  RowDistance compare(std::span<const float> query, std::span<const float> frame) const;
  /// The heading of a rotation about the vertical; none where another rotation fits best.
  std::vector<geometry::SE2WithCovariance> guesses(std::size_t rotation) const;

  /// The cell of a direction (not zero).
  std::size_t cell_of(const Eigen::Vector3d& direction) const;
  /// The rotations that map the cube to itself, in the order of `rotation`.
  static const std::vector<Eigen::Matrix3d>& rotations();

 private:
  std::size_t cells() const { return 6 * parameters_.grid * parameters_.grid; }
  Eigen::Vector3d middle_of(std::size_t cell) const;

  Glarot3dParameters parameters_;
  double place_sigma_m_;
  std::vector<std::vector<std::uint32_t>> rotated_;  ///< Target cell by rotation and cell.
};

}  // namespace understory::place_recognition::detectors
