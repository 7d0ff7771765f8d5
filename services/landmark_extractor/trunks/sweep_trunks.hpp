// Selects the columns of returns that are trunks.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/trunks/column_fit.hpp"
#include "services/landmark_extractor/trunks/level.hpp"
#include "services/landmark_extractor/trunks/stem_probe.hpp"
#include "services/landmark_extractor/trunks/trunk_columns.hpp"

namespace understory::landmark_extractor::trunks {

/// Counts of columns of returns since the start.
struct TrunkCounters {
  std::uint64_t columns = 0;         ///< Found.
  std::uint64_t too_few_points = 0;  ///< Or too few rings.
  std::uint64_t no_fit = 0;          ///< The estimate did not converge, or runs disagreed.
  std::uint64_t wrong_radius = 0;    ///< Thinner or thicker than a trunk.
  std::uint64_t leaning = 0;         ///< A branch.
  std::uint64_t not_round = 0;       ///< Residuals too large.
  std::uint64_t uncertain = 0;       ///< Too few measurements: sigma of the centre too large.
  std::uint64_t not_standing = 0;    ///< Ends above the ground or below a person's height.
  std::uint64_t in_leaves = 0;       ///< More returns around it than on it.
  std::uint64_t out_of_range = 0;    ///< Beyond the range limit of landmarks.
  std::uint64_t trunks = 0;          ///< Published.
};

/// Finds the trunks in one sweep. Reuses memory between sweeps, but has no state.
class SweepTrunks {
 public:
  /// `sweep`: parameters common with corners.
  SweepTrunks(const SweepParameters& sweep, const SweepTrunkParameters& trunk)
      : sweep_(sweep), trunk_(trunk), fitter_(sweep, trunk) {}

  /// Appends the trunks to `detections`, frame `vehicle_level`: the axis at breast height. The
  /// covariance includes the fit, the ground's height times the lean, the attitude, and the stem's
  /// shape. `level_covariance_rad2`: of (roll, pitch).
  void find(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
            const ground::GroundSurface& ground, const Eigen::Matrix2d& level_covariance_rad2,
            std::vector<model::Detection>& detections);
  /// Since the start.
  const TrunkCounters& counters() const { return counters_; }

 private:
  /// The trunk of a column; else none, and the reason is counted.
  std::optional<model::Detection> judge(const rings::RingCloud& cloud,
                                        const std::vector<rings::Run>& runs, const Column& column,
                                        const ground::GroundSurface& ground,
                                        const Eigen::Matrix2d& level_covariance_rad2);
  bool plausible(const StemFit& fit, double breast_z);
  bool is_in_leaves(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                    const StemFit& fit);
  /// Whether it reaches from the ground to above a person's height.
  bool is_tall(const StemProbe& probe);

  SweepParameters sweep_;
  SweepTrunkParameters trunk_;
  ColumnFinder columns_;
  StemFitter fitter_;
  TrunkCounters counters_;
  std::vector<std::uint32_t> near_;  ///< Runs near a stem.
};

}  // namespace understory::landmark_extractor::trunks
