// What the beams measure of one column of runs, as the stem's fit needs it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/trunks/stem_terms.hpp"
#include "services/landmark_extractor/trunks/trunk_columns.hpp"

namespace understory::landmark_extractor::trunks {

/// More evidence than this costs time and adds nothing beyond the shape's own uncertainty.
inline constexpr std::size_t kMaxRuns = 10;

/// What is asked of a run again and again. Frame `vehicle_level`.
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

/// Beams that hit the runs of a column and lines of sight past their edges, about the column's
/// centre. Keeps its memory from column to column.
class StemEvidence {
 public:
  /// Noise and beam width are taken from the parameters.
  StemEvidence(const SweepParameters& sweep, const SweepTrunkParameters& trunk)
      : sweep_(sweep), trunk_(trunk) {}

  /// How likely a beam without a return beside a run met the stem, too.
  void expect_lost(double share) { lost_share_ = share; }
  /// Starts with a column: its runs in short.
  void summarise(const std::vector<rings::Run>& runs, const Column& column);
  /// Hits and edges of the runs that were summarised.
  void take(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs);

  /// What all coordinates are relative to, frame `vehicle_level`.
  const Eigen::Vector2d& anchor_m() const { return anchor_m_; }
  const std::vector<RunSummary>& runs() const { return summaries_; }  ///< In order of height.
  const std::vector<HitLanes>& hits() const { return hits_; }         ///< A group for each run.
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

/// The evidence of those runs that agree, of at most `kMaxRuns`. Edges that several rings measure
/// at the same place share their information.
class AgreeingEvidence {
 public:
  /// Takes hits and edges of the runs at `places`, spread over the height. Precondition: not empty.
  void select(const StemEvidence& evidence, const std::vector<std::uint32_t>& places);

  const std::vector<HitLanes>& hits() const { return hits_; }  ///< A group for each run used.
  const std::vector<EdgeLanes>& edges() const { return edges_; }
  std::size_t edge_count() const { return edge_count_; }  ///< Lanes of edges() that count.

 private:
  void use_edge(const EdgeLanes& from, std::size_t lane);
  void share_edges();

  std::vector<HitLanes> hits_;
  std::vector<EdgeLanes> edges_;
  std::size_t edge_count_ = 0;
};

}  // namespace understory::landmark_extractor::trunks
