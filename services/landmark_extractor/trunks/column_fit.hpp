// A round, leaning, tapering stem through the runs of one column.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/landmark_extractor/trunks/stem_terms.hpp"
#include "services/landmark_extractor/trunks/trunk_columns.hpp"

namespace understory::landmark_extractor::trunks {

/// A stem whose axis passes through (x, y) at height `reference_z_m` in frame `vehicle_level`.
struct StemFit {
  /// x, y [m] and radius [m] at the reference height; then their changes per metre of height.
  Vector6d state = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  double reference_z_m = 0.0;
  double mean_square_residual = 0.0;  ///< Of ranges and edges, in their standard deviations.
  double low_z_m = 0.0;               ///< Lowest and highest run that agrees.
  double high_z_m = 0.0;
  /// Of the hits, as seen from above; and how much worse an upright plane explains them (chi^2).
  double width_m = 0.0;
  double flat_excess = 0.0;
  std::size_t points = 0;  ///< On runs that agree.
  std::size_t rings = 0;
  bool sees_left = false;  ///< An edge on that side.
  bool sees_right = false;

  Eigen::Vector2d centre_at(double z_m) const {
    return state.head<2>() + (z_m - reference_z_m) * state.segment<2>(3);
  }
  double radius_at(double z_m) const { return state[2] + (z_m - reference_z_m) * state[5]; }
};

/// Maximum a posteriori estimate from the ranges of the beams, the lines of sight past the edges
/// that are seen, and priors of radius, taper and lean, which decide where little is seen. Runs
/// that do not agree with the rest (branches, leaves) are left out and the rest is fitted again.
/// None where the estimate does not settle on a stem before the sensor.
class StemFitter {
 public:
  StemFitter(const SweepParameters& sweep, const SweepTrunkParameters& trunk)
      : sweep_(sweep),
        trunk_(trunk),
        noise_{static_cast<float>(sweep.range_sigma_m * sweep.range_sigma_m +
                                  trunk.roundness_sigma_m * trunk.roundness_sigma_m),
               static_cast<float>(sweep.beam_width_rad)} {}

  std::optional<StemFit> fit(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                             const Column& column);
  /// How likely a beam without a return beside a run met the stem, too.
  void expect_lost(double share) { lost_share_ = share; }
  /// The runs of the last fit that agreed with it, in order of height.
  const std::vector<std::uint32_t>& agreeing() const { return agreeing_; }

 private:
  /// The anchor of all that follows is the column's centre.
  void summarise(const std::vector<rings::Run>& runs, const Column& column);
  void take_evidence(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs);
  void add_hits(const rings::RingCloud& cloud, const rings::Run& run, HitLanes& hits) const;
  void add_edge(const rings::RingCloud& cloud, const rings::Run& run, float side, EdgeLanes& edges,
                std::size_t lane) const;
  void start_with_consensus();
  void use_agreeing();
  void share_edges();
  Vector6d start() const;
  bool settle(Vector6d& state, double settled_m2);
  void linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient,
                 double& squares) const;
  /// What grazing hits and edges know and do not weigh.
  Matrix6d unused_information(const Vector6d& state) const;
  /// Whether the runs that agree are others than before.
  bool sort_out(const Vector6d& state);
  StemState stem_of(const Vector6d& state) const;
  bool has_enough() const;
  void describe(const Vector6d& state, StemFit& fit);
  void compare_with_plane(const Vector6d& state, StemFit& fit);

  /// What is asked of a run again and again.
  struct RunSummary {
    std::uint32_t index = 0;
    float x_m = 0.0F;  ///< Of the centre.
    float y_m = 0.0F;
    float z_m = 0.0F;
    float width_m = 0.0F;
    float nearest_m = 0.0F;
    float points = 0.0F;
    std::uint16_t ring = 0;
    std::uint16_t middle = 0;  ///< Lane of the hit in the middle.
  };

  SweepParameters sweep_;
  SweepTrunkParameters trunk_;
  BeamNoise noise_;
  double lost_share_ = 0.0;  ///< See expect_lost().
  double reference_z_m_ = 0.0;
  Eigen::Vector2d anchor_m_ = Eigen::Vector2d::Zero();
  std::vector<RunSummary> summaries_;       ///< Of the column's runs.
  std::vector<HitLanes> hits_;              ///< A group for each run.
  std::vector<EdgeLanes> edges_;            ///< Of the k-th run: lanes 2 k (left), 2 k + 1 (right).
  std::vector<std::uint32_t> agreeing_at_;  ///< Places in these.
  std::vector<std::uint32_t> still_agreeing_at_;
  std::vector<std::uint32_t> agreeing_;  ///< Runs.
  std::vector<HitLanes> used_hits_;      ///< Of the agreeing runs that give evidence.
  std::vector<EdgeLanes> used_edges_;
  std::size_t used_edge_count_ = 0;
  std::vector<float> hit_means_;
  std::vector<Lanes> edge_squares_;
};

}  // namespace understory::landmark_extractor::trunks
