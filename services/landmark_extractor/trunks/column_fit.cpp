#include "services/landmark_extractor/trunks/column_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/landmark_extractor/square.hpp"
#include "services/landmark_extractor/trunks/column_plane.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

constexpr int kIterations = 8;
/// The next step of the estimate would be far smaller than the square of this one...
constexpr double kSettled_m2 = 4e-7;
/// ... and the estimate is accurate enough to select the agreeing runs.
constexpr double kNearlySettled_m2 = 1e-5;
/// A run disagrees if the root mean square of its ranges, or an edge of it, is off by more [sigma].
constexpr float kMaxRunResidual = 2.5F;
constexpr float kMaxEdgeResidual = 3.5F;
constexpr int kConsensusRounds = 4;
/// Largest distance between runs of one stem, and its increase per metre of height.
constexpr float kConsensus_m = 0.06F;
constexpr float kConsensusLean = 0.06F;

}  // namespace

std::optional<StemFit> StemFitter::fit(const rings::RingCloud& cloud,
                                       const std::vector<rings::Run>& runs, const Column& column) {
  // Which runs have nearly the same centre?
  evidence_.summarise(runs, column);
  start_with_consensus();
  if (!has_enough()) return std::nullopt;

  // Fits, removes disagreeing runs, and fits again.
  evidence_.take(cloud, runs);
  Vector6d state = Vector6d::Zero();
  for (int round = 0; round < kConsensusRounds; ++round) {
    if (!has_enough()) return std::nullopt;
    used_.select(evidence_, agreeing_at_);
    if (round == 0) {
      state = start();
      reference_z_m_.reset();
    }
    if (!settle(state, kNearlySettled_m2)) return std::nullopt;
    if (!sort_out(state)) break;
  }

  if (!has_enough() || !settle(state, kSettled_m2)) return std::nullopt;
  StemFit fit;
  describe(state, fit);
  return fit;
}

/// Selects the largest group of runs with nearly the same centre, counted in points.
void StemFitter::start_with_consensus() {
  const std::size_t count = std::min(evidence_.runs().size(), kMaxRuns);
  const auto near = [](const RunSummary& a, const RunSummary& b) {
    const float limit = kConsensus_m + kConsensusLean * std::abs(a.z_m - b.z_m);
    return square(a.x_m - b.x_m) + square(a.y_m - b.y_m) < square(limit);
  };

  float most = 0.0F;
  std::size_t best = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t candidate = k * evidence_.runs().size() / count;
    float points = 0.0F;
    for (const RunSummary& run : evidence_.runs()) {
      points += near(evidence_.runs()[candidate], run) ? run.points : 0.0F;
    }
    if (points > most) {
      most = points;
      best = candidate;
    }
  }

  agreeing_at_.clear();
  for (std::uint32_t k = 0; k < evidence_.runs().size(); ++k) {
    if (near(evidence_.runs()[best], evidence_.runs()[k])) agreeing_at_.push_back(k);
  }
}

/// At least as many points and rings as a trunk must have.
bool StemFitter::has_enough() const {
  float points = 0.0F;
  int rings = 0;
  std::uint16_t ring = 0xffff;
  for (const std::uint32_t k : agreeing_at_) {
    points += evidence_.runs()[k].points;
    if (evidence_.runs()[k].ring != ring) ++rings;
    ring = evidence_.runs()[k].ring;
  }
  return points >= static_cast<float>(trunk_.min_points) && rings >= trunk_.min_rings &&
         !agreeing_at_.empty();
}

/// From the longest run: its width gives the radius.
Vector6d StemFitter::start() const {
  const auto longest = *std::max_element(
      agreeing_at_.begin(), agreeing_at_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return evidence_.runs()[a].points < evidence_.runs()[b].points;
      });

  const RunSummary& run = evidence_.runs()[longest];
  const HitLanes& hits = evidence_.hits()[longest];
  const double radius =
      std::clamp(0.5 * static_cast<double>(run.width_m), trunk_.min_radius_m, trunk_.max_radius_m);
  const double distance = run.nearest_m + radius;
  const std::size_t l = run.middle;

  Vector6d state = Vector6d::Zero();
  state[0] = hits.origin_x[l] + distance * hits.along_x[l];
  state[1] = hits.origin_y[l] + distance * hits.along_y[l];
  state[2] = radius;
  state[5] = trunk_.prior_taper;
  return state;
}

StemState StemFitter::stem_of(const Vector6d& state) const {
  StemState stem;
  for (int i = 0; i < 6; ++i) {
    stem.values[static_cast<std::size_t>(i)] = static_cast<float>(state[i]);
  }
  stem.reference_z_m = static_cast<float>(*reference_z_m_);
  return stem;
}

void StemFitter::linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient,
                           double& squares) const {
  StemSums sums;
  add_terms(used_.hits(), used_.edges(), stem_of(state), noise_, sums);
  sums.normal_equations(information, gradient);
  squares = sums.sum_of_squares();

  const auto prior = [&](int at, double mean, double sigma) {
    information(at, at) += 1.0 / square(sigma);
    gradient[at] += (mean - state[at]) / square(sigma);
  };
  prior(2, trunk_.prior_radius_m, trunk_.prior_radius_sigma_m);
  prior(3, 0.0, trunk_.prior_lean_sigma_rad);
  prior(4, 0.0, trunk_.prior_lean_sigma_rad);
  prior(5, trunk_.prior_taper, trunk_.prior_taper_sigma);
}

bool StemFitter::settle(Vector6d& state, double settled_m2) {
  // The reference height is the mean of the hits.
  double z = 0.0;
  double count = 0.0;
  for (const HitLanes& group : used_.hits()) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      z += group.counts[l] * group.z[l];
      count += group.counts[l];
    }
  }
  const double reference = z / count;
  if (reference_z_m_) state.head<3>() += (reference - *reference_z_m_) * state.tail<3>();
  reference_z_m_ = reference;

  // Gauss and Newton.
  Matrix6d information;
  Vector6d gradient;
  Vector6d change;
  double squares = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    linearise(state, information, gradient, squares);
    if (!solve_normal(information, gradient, change)) return false;
    state += change;
    state[2] = std::clamp(state[2], 0.5 * trunk_.min_radius_m, 2.0 * trunk_.max_radius_m);
    if (!state.allFinite()) return false;
    if (change.head<3>().squaredNorm() < settled_m2) break;
  }

  // The stem must be in front of the sensor, not around it.
  const HitLanes& any = used_.hits().front();
  return (state[0] - any.origin_x[0]) * any.along_x[0] +
             (state[1] - any.origin_y[0]) * any.along_y[0] >
         1.1 * state[2];
}

bool StemFitter::sort_out(const Vector6d& state) {
  hit_means_.resize(evidence_.hits().size());
  edge_squares_.resize(evidence_.edges().size());
  square_terms(evidence_.hits(), evidence_.edges(), stem_of(state), noise_, hit_means_,
               edge_squares_);

  still_agreeing_at_.clear();
  for (std::uint32_t k = 0; k < evidence_.runs().size(); ++k) {
    const Lanes& squares = edge_squares_[2 * k / kLanes];
    const std::size_t lane = 2 * k % kLanes;
    const bool agrees = hit_means_[k] <= square(kMaxRunResidual) &&
                        squares[lane] < square(kMaxEdgeResidual) &&
                        squares[lane + 1] < square(kMaxEdgeResidual);
    if (agrees) still_agreeing_at_.push_back(k);
  }

  const bool is_new = still_agreeing_at_ != agreeing_at_;
  std::swap(agreeing_at_, still_agreeing_at_);
  return is_new;
}

Matrix6d StemFitter::unused_information(const Vector6d& state) const {
  StemSums sums;
  add_unused(used_.hits(), used_.edges(), stem_of(state), noise_, sums);
  Matrix6d unused;
  Vector6d ignored;
  sums.normal_equations(unused, ignored);
  return unused;
}

void StemFitter::describe(const Vector6d& state, StemFit& fit) const {
  Matrix6d information;
  Vector6d gradient;
  double squares = 0.0;
  linearise(state, information, gradient, squares);

  // Grazing beams and edges are weighted below their information: the covariance follows from the
  // weights.
  const Matrix6d inverse = information.inverse();
  fit.covariance = inverse * (information - unused_information(state)) * inverse;

  fit.state = state;
  fit.state.head<2>() += evidence_.anchor_m();
  fit.reference_z_m = *reference_z_m_;

  double terms = static_cast<double>(used_.edge_count());
  for (const HitLanes& group : used_.hits()) {
    for (const float counts : group.counts) terms += counts;
  }
  fit.mean_square_residual = squares / terms;

  // Is it more likely a strip of a wall?
  const PlaneComparison plane =
      compare_with_plane(used_.hits(), stem_of(state), noise_, sweep_, trunk_);
  fit.width_m = plane.width_m;
  fit.flat_excess = plane.flat_excess;

  fit.low_z_m = evidence_.runs()[agreeing_at_.front()].z_m;
  fit.high_z_m = evidence_.runs()[agreeing_at_.back()].z_m;

  std::uint16_t ring = 0xffff;
  for (const std::uint32_t k : agreeing_at_) {
    const RunSummary& run = evidence_.runs()[k];
    fit.points += static_cast<std::size_t>(run.points);
    if (run.ring != ring) ++fit.rings;
    ring = run.ring;
  }
}

}  // namespace understory::landmark_extractor::trunks
