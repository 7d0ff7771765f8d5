// Groups runs of several rings that are one above the other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_runs.hpp"

namespace understory::landmark_extractor::trunks {

/// Runs that may be slices of one trunk.
struct Column {
  std::span<const std::uint32_t> runs;                 ///< Indices, in order of height.
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();  ///< Mean of the runs' centres.
  std::size_t points = 0;                              ///< Of all its runs.
};

/// Finds columns in the plan with a grid of 0.5 m cells. Reuses memory between sweeps, but has no
/// state.
class ColumnFinder {
 public:
  /// The columns within `reach_m` of `centre_m`, valid until the next call. Greedy: the run with
  /// most points first; each takes the free runs around its vertical, then again around their mean.
  /// Runs wider than a trunk or with touching neighbours are excluded.
  const std::vector<Column>& find(const std::vector<rings::Run>& runs,
                                  const SweepTrunkParameters& parameters,
                                  const Eigen::Vector2f& centre_m, float reach_m);

  /// Runs of the last find() up to `highest_m` above ground with centres within the radius,
  /// whatever their column.
  void runs_near(const std::vector<rings::Run>& runs, const Eigen::Vector2f& centre_m,
                 float radius_m, float highest_m, std::vector<std::uint32_t>& near) const;

 private:
  template <class Visit>
  void visit_near(const std::vector<rings::Run>& runs, const Eigen::Vector2f& axis, float radius,
                  Visit visit) const;
  void fill_grid(const std::vector<rings::Run>& runs, const SweepTrunkParameters& parameters);
  std::size_t cell(float coordinate, float corner) const;
  void gather(const std::vector<rings::Run>& runs, const Eigen::Vector2f& axis, float radius);

  float corner_x_ = 0.0F;
  float corner_y_ = 0.0F;
  std::size_t side_ = 0;
  std::vector<std::int32_t> heads_;   ///< First run per cell, -1 = none.
  std::vector<std::int32_t> next_;    ///< Next run in the same cell.
  std::vector<std::uint64_t> order_;  ///< Runs with most points first.
  std::vector<std::uint8_t> taken_;
  std::vector<std::uint32_t> gathered_;
  std::vector<std::uint32_t> members_;  ///< Of all columns, one after the other.
  std::vector<Column> columns_;
};

}  // namespace understory::landmark_extractor::trunks
