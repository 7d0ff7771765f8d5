// Measurements of one column of runs, prepared for the fit of a stem.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/trunks/stem_terms.hpp"
#include "services/landmark_extractor/trunks/trunk_columns.hpp"

namespace understory::landmark_extractor::trunks {

/// More runs than this cost time without reducing the uncertainty, which the shape then dominates.
inline constexpr std::size_t kMaxRuns = 10;

/// Frequently used values of a run. Frame `vehicle_level`.
struct RunSummary {
  std::uint32_t index = 0;  ///< Of the run, among those of the sweep.
  float x_m = 0.0F;         ///< Of the centre.
  float y_m = 0.0F;
  float z_m = 0.0F;
  float width_m = 0.0F;
  float nearest_m = 0.0F;  ///< Least range.
  float points = 0.0F;
  std::uint16_t ring = 0;
  std::uint16_t middle = 0;  ///< Lane of the hit in the middle.
};

/// Beams that hit the runs of a column and lines of sight past their edges, relative to the
/// column's centre. Reuses memory between columns.
class StemEvidence {
 public:
  /// Noise and beam width are taken from the parameters.
  StemEvidence(const SweepParameters& sweep, const SweepTrunkParameters& trunk)
      : sweep_(sweep), trunk_(trunk) {}

  /// Sets the probability that a beam without a return beside a run hit the stem, too.
  void expect_lost(double share) { lost_share_ = share; }
  /// Starts with a column: summarises its runs.
  void summarise(const std::vector<rings::Run>& runs, const Column& column);
  /// Adds hits and edges of the summarised runs.
  void take(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs);

  /// Origin of all coordinates, frame `vehicle_level`.
  const Eigen::Vector2d& anchor_m() const { return anchor_m_; }
  const std::vector<RunSummary>& runs() const { return summaries_; }  ///< In order of height.
  const std::vector<HitLanes>& hits() const { return hits_; }         ///< One group per run.
  /// Of the k-th run: lanes 2 k (left) and 2 k + 1 (right).
  const std::vector<EdgeLanes>& edges() const { return edges_; }

 private:
  void add_hits(const rings::RingCloud& cloud, const rings::Run& run, HitLanes& hits) const;
  void add_edge(const rings::RingCloud& cloud, const rings::Run& run, float side, EdgeLanes& edges,
                std::size_t lane) const;

  SweepParameters sweep_;
  SweepTrunkParameters trunk_;
  double lost_share_ = 0.0;  ///< See expect_lost().
  Eigen::Vector2d anchor_m_ = Eigen::Vector2d::Zero();
  std::vector<RunSummary> summaries_;
  std::vector<HitLanes> hits_;
  std::vector<EdgeLanes> edges_;
};

/// The measurements of the agreeing runs, at most `kMaxRuns`. Edges that several rings measure at
/// the same azimuth share their information.
class AgreeingEvidence {
 public:
  /// Adds hits and edges of the runs at `places`, distributed over the height. Precondition: not
  /// empty.
  void select(const StemEvidence& evidence, const std::vector<std::uint32_t>& places);

  const std::vector<HitLanes>& hits() const { return hits_; }  ///< One group per run used.
  const std::vector<EdgeLanes>& edges() const { return edges_; }
  std::size_t edge_count() const { return edge_count_; }  ///< Number of valid lanes in edges().

 private:
  void use_edge(const EdgeLanes& from, std::size_t lane);
  void share_edges();

  std::vector<HitLanes> hits_;
  std::vector<EdgeLanes> edges_;
  std::size_t edge_count_ = 0;
};

}  // namespace understory::landmark_extractor::trunks
