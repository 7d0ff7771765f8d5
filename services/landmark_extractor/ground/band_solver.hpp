// Linear systems with a symmetric positive definite band matrix.
#pragma once

#include <cstddef>

#include "services/landmark_extractor/lanes.hpp"

namespace understory::landmark_extractor::ground {

/// Layout of the lower band, column by column: column j begins at j * stride with its diagonal
/// entry; zeros follow the band's entries up to the stride.
struct BandLayout {
  std::size_t size = 0;    ///< Unknowns.
  std::size_t band = 0;    ///< Entries per column, with the diagonal one.
  std::size_t stride = 0;  ///< From column to column.

  /// For `size` unknowns with `band` entries per column.
  static BandLayout of(std::size_t size, std::size_t band) {
    return {size, band, padded_to_lanes(band) + kLanes};
  }
  /// Number of values of the whole matrix.
  std::size_t entries() const { return size * stride; }
  /// Number of values of a right-hand side, with zeros behind it.
  std::size_t padded_size() const { return size + stride; }

 private:
};

/// Solves in place (Cholesky without pivoting, vectorised): `matrix` becomes its Cholesky factor,
/// `right` (padded_size() values) the solution. Entries of rows beyond the last must be zero.
void solve_band(const BandLayout& layout, float* matrix, float* right);

}  // namespace understory::landmark_extractor::ground
