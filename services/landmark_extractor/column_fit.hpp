// A round, leaning, tapering stem through the runs of one column.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/landmark_extractor/trunk_columns.hpp"

namespace understory {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A stem whose axis passes through (x, y) at height `reference_z_m` in frame `vehicle_level`.
struct StemFit {
  /// x, y [m] and radius [m] at the reference height; then their changes per metre of height.
  Vector6d state = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  double reference_z_m = 0.0;
  double mean_square_residual = 0.0;  ///< Of ranges and edges, in their standard deviations.
  double low_z_m = 0.0;               ///< Lowest and highest run that agrees.
  double high_z_m = 0.0;
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
      : sweep_(sweep), trunk_(trunk) {}

  std::optional<StemFit> fit(const RingCloud& cloud, const std::vector<Run>& runs,
                             const Column& column);
  /// The runs of the last fit that agreed with it, in order of height.
  const std::vector<std::uint32_t>& agreeing() const { return agreeing_; }

 private:
  /// A beam that hit the stem.
  struct Hit {
    Sight sight;
    double range_m;
    double z_m;
    std::uint32_t run;
  };
  /// A line of sight that just passes by: side +1 = left.
  struct Edge {
    Sight sight;
    double z_m;
    double side;
    double sigma_m;
    std::uint32_t run;
  };

  void start_with_consensus(const std::vector<Run>& runs, const Column& column);
  void choose_runs();
  void take_evidence(const RingCloud& cloud, const std::vector<Run>& runs);
  void share_edges();
  Vector6d start(const RingCloud& cloud, const std::vector<Run>& runs) const;
  bool settle(Vector6d& state);
  void linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient);
  /// Whether the runs that agree are others than before.
  bool sort_out(const RingCloud& cloud, const std::vector<Run>& runs, const Column& column,
                const Vector6d& state);
  bool agrees(const RingCloud& cloud, const Run& run, const Vector6d& state) const;
  Edge edge_of(const RingCloud& cloud, const Run& run, std::uint32_t index, double side) const;
  void describe(const Vector6d& state, const std::vector<Run>& runs, StemFit& fit);

  SweepParameters sweep_;
  SweepTrunkParameters trunk_;
  double reference_z_m_ = 0.0;
  std::vector<std::uint32_t> agreeing_;
  std::vector<std::uint32_t> used_;  ///< Of those, the ones that give evidence.
  std::vector<Hit> hits_;
  std::vector<Edge> edges_;
  std::vector<double> shares_;
  std::vector<std::uint32_t> still_agreeing_;
};

}  // namespace understory
