// Fit of a round, leaning, tapering stem to the runs of one column.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/landmark_extractor/trunks/stem_evidence.hpp"
#include "services/landmark_extractor/trunks/stem_terms.hpp"
#include "services/landmark_extractor/trunks/trunk_columns.hpp"

namespace understory::landmark_extractor::trunks {

/// A stem whose axis passes through (x, y) at height `reference_z_m` in frame `vehicle_level`.
struct StemFit {
  /// x, y [m] and radius [m] at the reference height; then their changes per metre of height.
  Vector6d state = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();  ///< Of the state.
  double reference_z_m = 0.0;
  double mean_square_residual = 0.0;  ///< Of ranges and edges, in their standard deviations.
  double low_z_m = 0.0;               ///< Of the lowest run that agrees.
  double high_z_m = 0.0;              ///< Of the highest one.
  double width_m = 0.0;               ///< Of the hits, as seen from above.
  double flat_excess = 0.0;  ///< chi^2 of an upright plane minus that of the stem, for the hits.
  std::size_t points = 0;    ///< On runs that agree.
  std::size_t rings = 0;     ///< Of runs that agree.

  /// Of the axis at a height, frame `vehicle_level`.
  Eigen::Vector2d centre_at(double z_m) const {
    return state.head<2>() + (z_m - reference_z_m) * state.segment<2>(3);
  }
  /// Of the stem at a height [m].
  double radius_at(double z_m) const { return state[2] + (z_m - reference_z_m) * state[5]; }
};

/// Maximum a posteriori estimate from the ranges of the beams, the lines of sight past visible
/// edges, and priors of radius, taper and lean, which dominate with few measurements. Runs that do
/// not agree with the rest (branches, leaves) are removed and the rest is fitted again. Reuses
/// memory between columns. Cost: some 10 us.
class StemFitter {
 public:
  /// Noise, priors and limits are taken from the parameters.
  StemFitter(const SweepParameters& sweep, const SweepTrunkParameters& trunk)
      : sweep_(sweep),
        trunk_(trunk),
        noise_{static_cast<float>(sweep.range_sigma_m * sweep.range_sigma_m +
                                  trunk.roundness_sigma_m * trunk.roundness_sigma_m),
               static_cast<float>(sweep.beam_width_rad)},
        evidence_(sweep, trunk) {}

  /// None if the estimate does not converge to a stem in front of the sensor, or too few runs
  /// agree.
  std::optional<StemFit> fit(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
                             const Column& column);
  /// Sets the probability that a beam without a return beside a run hit the stem, too.
  void expect_lost(double share) { evidence_.expect_lost(share); }

 private:
  void start_with_consensus();
  Vector6d start() const;
  bool settle(Vector6d& state, double settled_m2);
  void linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient,
                 double& squares) const;
  /// Correction of the information for reduced weights; see add_unused().
  Matrix6d unused_information(const Vector6d& state) const;
  /// Whether the set of agreeing runs has changed.
  bool sort_out(const Vector6d& state);
  StemState stem_of(const Vector6d& state) const;
  bool has_enough() const;
  void describe(const Vector6d& state, StemFit& fit) const;

  SweepParameters sweep_;
  SweepTrunkParameters trunk_;
  BeamNoise noise_;
  StemEvidence evidence_;                   ///< Of all runs of the column.
  AgreeingEvidence used_;                   ///< Of those that agree.
  std::optional<double> reference_z_m_;     ///< Of the state; none before the first fit.
  std::vector<std::uint32_t> agreeing_at_;  ///< Indices among the column's runs.
  std::vector<std::uint32_t> still_agreeing_at_;
  std::vector<float> hit_means_;
  std::vector<Lanes> edge_squares_;
};

}  // namespace understory::landmark_extractor::trunks
