#include "services/landmark_extractor/trunks/column_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace understory::landmark_extractor::trunks {
namespace {

/// More evidence than this costs time and adds nothing beyond the shape's own uncertainty.
constexpr std::size_t kMaxRuns = 10;
constexpr std::size_t kHitsPerRun = 7;
static_assert(kHitsPerRun <= kLanes);
constexpr int kIterations = 8;
/// The next step of the estimate would be smaller by far than this one's square...
constexpr double kSettled_m2 = 4e-7;
/// ... and near enough to tell which runs agree.
constexpr double kNearlySettled_m2 = 1e-5;
/// A run disagrees whose ranges are so far off in root mean square, or an edge of it [sigma].
constexpr float kMaxRunResidual = 2.5F;
constexpr float kMaxEdgeResidual = 3.5F;
constexpr int kRounds = 4;
/// Runs of one stem seem so far apart, and so much more per metre of height.
constexpr float kConsensus_m = 0.06F;
constexpr float kConsensusLean = 0.06F;

double square(double value) { return value * value; }
float square(float value) { return value * value; }

}  // namespace

std::optional<StemFit> StemFitter::fit(const rings::RingCloud& cloud,
                                       const std::vector<rings::Run>& runs, const Column& column) {
  summarise(runs, column);
  start_with_consensus();
  if (!has_enough()) return std::nullopt;
  take_evidence(cloud, runs);
  Vector6d state = Vector6d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    if (!has_enough()) return std::nullopt;
    use_agreeing();
    if (round == 0) state = start();
    if (!settle(state, kNearlySettled_m2)) return std::nullopt;
    if (!sort_out(state)) break;
  }
  if (!has_enough() || !settle(state, kSettled_m2)) return std::nullopt;
  StemFit fit;
  describe(state, fit);
  return fit;
}

void StemFitter::summarise(const std::vector<rings::Run>& runs, const Column& column) {
  anchor_m_ = column.centre_m;
  summaries_.clear();
  for (const std::uint32_t index : column.runs) {
    const rings::Run& run = runs[index];
    const std::size_t hits = std::min(run.size(), kHitsPerRun);
    summaries_.push_back({index, run.x_m, run.y_m, run.z_m, run.width_m, run.nearest_m,
                          static_cast<float>(run.size()), run.ring,
                          static_cast<std::uint16_t>(hits / 2)});
  }
}

void StemFitter::take_evidence(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs) {
  const std::size_t count = summaries_.size();
  hits_.assign(count, {});
  edges_.assign((2 * count + kLanes - 1) / kLanes, {});
  for (EdgeLanes& group : edges_) group.variance.fill(1.0F);
  for (std::size_t k = 0; k < count; ++k) {
    const rings::Run& run = runs[summaries_[k].index];
    add_hits(cloud, run, hits_[k]);
    EdgeLanes& edges = edges_[2 * k / kLanes];
    const std::size_t lane = 2 * k % kLanes;
    if (run.left == planar::Border::kClear) add_edge(cloud, run, 1.0F, edges, lane);
    if (run.right == planar::Border::kClear) add_edge(cloud, run, -1.0F, edges, lane + 1);
  }
}

/// Some of its points, spread over the run.
void StemFitter::add_hits(const rings::RingCloud& cloud, const rings::Run& run,
                          HitLanes& hits) const {
  const std::size_t count = std::min(run.size(), kHitsPerRun);
  for (std::size_t k = 0; k < count; ++k) {
    const points::RingPoint& point =
        cloud.points()[run.first + (2 * k + 1) * run.size() / (2 * count)];
    const rings::Sight sight = cloud.sight(point);
    hits.origin_x[k] = static_cast<float>(sight.origin_m.x() - anchor_m_.x());
    hits.origin_y[k] = static_cast<float>(sight.origin_m.y() - anchor_m_.y());
    hits.along_x[k] = static_cast<float>(sight.direction.x());
    hits.along_y[k] = static_cast<float>(sight.direction.y());
    hits.range[k] = point.range_m;
    hits.z[k] = point.z_m;
    hits.counts[k] = 1.0F;
  }
}

/// The edge lies somewhere between the run's last beam and the next; or, where that gave no return
/// and may have been lost, between that and the one after it.
void StemFitter::add_edge(const rings::RingCloud& cloud, const rings::Run& run, float side,
                          EdgeLanes& edges, std::size_t lane) const {
  const points::RingPoint& last = cloud.points()[side > 0.0F ? run.last : run.first];
  const double step = cloud.step_rad(run.ring);
  const bool is_silent = side > 0.0F ? run.is_left_silent : run.is_right_silent;
  const double lost = is_silent ? lost_share_ : 0.0;
  const double beyond = side * ((0.5 + lost) * step - sweep_.beam_width_rad);
  rings::Sight sight = cloud.sight(last);
  sight.direction += beyond * Eigen::Vector2d(-sight.direction.y(), sight.direction.x());
  sight.direction.normalize();
  edges.origin_x[lane] = static_cast<float>(sight.origin_m.x() - anchor_m_.x());
  edges.origin_y[lane] = static_cast<float>(sight.origin_m.y() - anchor_m_.y());
  edges.along_x[lane] = static_cast<float>(sight.direction.x());
  edges.along_y[lane] = static_cast<float>(sight.direction.y());
  edges.z[lane] = last.z_m;
  edges.side[lane] = side;
  edges.variance[lane] = static_cast<float>(square(static_cast<double>(last.range_m)) *
                                                (square(step) * (1.0 / 12.0 + lost * (1.0 - lost)) +
                                                 square(0.5 * sweep_.beam_width_rad)) +
                                            square(trunk_.roundness_sigma_m));
  edges.counts[lane] = 1.0F;
}

/// The largest group of runs with nearly the same centre, counted in points.
void StemFitter::start_with_consensus() {
  const std::size_t count = std::min(summaries_.size(), kMaxRuns);
  const auto near = [](const RunSummary& a, const RunSummary& b) {
    const float limit = kConsensus_m + kConsensusLean * std::abs(a.z_m - b.z_m);
    return square(a.x_m - b.x_m) + square(a.y_m - b.y_m) < square(limit);
  };
  float most = 0.0F;
  std::size_t best = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t candidate = k * summaries_.size() / count;
    float points = 0.0F;
    for (const RunSummary& run : summaries_) {
      points += near(summaries_[candidate], run) ? run.points : 0.0F;
    }
    if (points > most) {
      most = points;
      best = candidate;
    }
  }
  agreeing_at_.clear();
  for (std::uint32_t k = 0; k < summaries_.size(); ++k) {
    if (near(summaries_[best], summaries_[k])) agreeing_at_.push_back(k);
  }
}

/// At least as many points and rings as a trunk must have.
bool StemFitter::has_enough() const {
  float points = 0.0F;
  int rings = 0;
  std::uint16_t ring = 0xffff;
  for (const std::uint32_t k : agreeing_at_) {
    points += summaries_[k].points;
    if (summaries_[k].ring != ring) ++rings;
    ring = summaries_[k].ring;
  }
  return points >= static_cast<float>(trunk_.min_points) && rings >= trunk_.min_rings &&
         !agreeing_at_.empty();
}

/// Evidence of at most kMaxRuns of the agreeing runs, spread over the height.
void StemFitter::use_agreeing() {
  used_hits_.clear();
  used_edges_.clear();
  used_edge_count_ = 0;
  const std::size_t count = std::min(agreeing_at_.size(), kMaxRuns);
  const auto use = [&](const EdgeLanes& from, std::size_t lane) {
    if (from.counts[lane] == 0.0F) return;
    const std::size_t to_lane = used_edge_count_++ % kLanes;
    if (to_lane == 0) {
      used_edges_.emplace_back();
      used_edges_.back().variance.fill(1.0F);
    }
    EdgeLanes& to = used_edges_.back();
    to.origin_x[to_lane] = from.origin_x[lane];
    to.origin_y[to_lane] = from.origin_y[lane];
    to.along_x[to_lane] = from.along_x[lane];
    to.along_y[to_lane] = from.along_y[lane];
    to.z[to_lane] = from.z[lane];
    to.side[to_lane] = from.side[lane];
    to.variance[to_lane] = from.variance[lane];
    to.counts[to_lane] = 1.0F;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = agreeing_at_[i * agreeing_at_.size() / count];
    used_hits_.push_back(hits_[k]);
    use(edges_[2 * k / kLanes], 2 * k % kLanes);
    use(edges_[2 * k / kLanes], 2 * k % kLanes + 1);
  }
  share_edges();
}

/// Rings that fire at the same azimuths miss an upright edge by the same part of a step: together
/// they say no more than one does. What they say together counts by their number, so that one ring
/// that lost a beam at the edge does not say as much as all others.
/// Of an edge that slants over M columns in N rings, the steps' errors are no independent draws:
/// they run through the step, and their mean is off by 1 / (2 M^2) of a step's variance, or M / N^2
/// where that is more (within a fifth of what a simulation of such lines gives).
void StemFitter::share_edges() {
  std::array<float, 2 * kMaxRuns> shares{};
  const float range2 = square(used_hits_.front().range[0]);
  const auto lane_of = [](std::size_t i) { return i % kLanes; };
  for (std::size_t i = 0; i < used_edge_count_; ++i) {
    const EdgeLanes& a = used_edges_[i / kLanes];
    const std::size_t l = lane_of(i);
    for (std::size_t j = 0; j < used_edge_count_; ++j) {
      const EdgeLanes& b = used_edges_[j / kLanes];
      const std::size_t m = lane_of(j);
      const float apart = a.along_x[l] * b.along_y[m] - a.along_y[l] * b.along_x[m];
      const bool same = a.side[l] == b.side[m] && square(apart) * range2 < a.variance[l];
      shares[i] += same ? 1.0F : 0.0F;
    }
  }
  // Of each side: how many edges, and at how many places.
  std::array<float, 2> edges{};
  std::array<float, 2> places{};
  const auto side_of = [&](std::size_t i) {
    return used_edges_[i / kLanes].side[lane_of(i)] > 0.0F ? 1U : 0U;
  };
  for (std::size_t i = 0; i < used_edge_count_; ++i) {
    edges[side_of(i)] += 1.0F;
    places[side_of(i)] += 1.0F / shares[i];
  }
  for (std::size_t i = 0; i < used_edge_count_; ++i) {
    const auto side = side_of(i);
    EdgeLanes& group = used_edges_[i / kLanes];
    const float per_place = edges[side] / places[side];
    group.variance[lane_of(i)] *= per_place;
    group.surplus[lane_of(i)] = 1.0F - std::max(0.5F / places[side], 1.0F / square(per_place));
  }
}

/// From the longest run: its width gives the radius.
Vector6d StemFitter::start() const {
  const auto longest = *std::max_element(agreeing_at_.begin(), agreeing_at_.end(),
                                         [&](std::uint32_t a, std::uint32_t b) {
                                           return summaries_[a].points < summaries_[b].points;
                                         });
  const RunSummary& run = summaries_[longest];
  const HitLanes& hits = hits_[longest];
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
  stem.reference_z_m = static_cast<float>(reference_z_m_);
  return stem;
}

void StemFitter::linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient,
                           double& squares) const {
  StemSums sums;
  add_terms(used_hits_, used_edges_, stem_of(state), noise_, sums);
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
  double z = 0.0;
  double count = 0.0;
  for (const HitLanes& group : used_hits_) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      z += group.counts[l] * group.z[l];
      count += group.counts[l];
    }
  }
  const double reference = z / count;
  state.head<3>() += (reference - reference_z_m_) * state.tail<3>();
  reference_z_m_ = reference;
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
  const HitLanes& any = used_hits_.front();
  return (state[0] - any.origin_x[0]) * any.along_x[0] +
             (state[1] - any.origin_y[0]) * any.along_y[0] >
         1.1 * state[2];
}

bool StemFitter::sort_out(const Vector6d& state) {
  hit_means_.resize(hits_.size());
  edge_squares_.resize(edges_.size());
  square_terms(hits_, edges_, stem_of(state), noise_, hit_means_, edge_squares_);
  still_agreeing_at_.clear();
  for (std::uint32_t k = 0; k < summaries_.size(); ++k) {
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
  add_unused(used_hits_, used_edges_, stem_of(state), noise_, sums);
  Matrix6d unused;
  Vector6d ignored;
  sums.normal_equations(unused, ignored);
  return unused;
}

void StemFitter::describe(const Vector6d& state, StemFit& fit) {
  Matrix6d information;
  Vector6d gradient;
  double squares = 0.0;
  linearise(state, information, gradient, squares);
  // What grazing beams and edges weigh less than their noise is lost, not unknown.
  const Matrix6d inverse = information.inverse();
  fit.covariance = inverse * (information - unused_information(state)) * inverse;
  fit.state = state;
  fit.state.head<2>() += anchor_m_;
  fit.reference_z_m = reference_z_m_;
  double terms = static_cast<double>(used_edge_count_);
  for (const HitLanes& group : used_hits_) {
    for (const float counts : group.counts) terms += counts;
  }
  fit.mean_square_residual = squares / terms;
  for (const EdgeLanes& group : used_edges_) {
    for (const float side : group.side) {
      if (side > 0.0F) fit.sees_left = true;
      if (side < 0.0F) fit.sees_right = true;
    }
  }
  compare_with_plane(state, fit);
  fit.low_z_m = summaries_[agreeing_at_.front()].z_m;
  fit.high_z_m = summaries_[agreeing_at_.back()].z_m;
  agreeing_.clear();
  std::uint16_t ring = 0xffff;
  for (const std::uint32_t k : agreeing_at_) {
    const RunSummary& run = summaries_[k];
    agreeing_.push_back(run.index);
    fit.points += static_cast<std::size_t>(run.points);
    if (run.ring != ring) ++fit.rings;
    ring = run.ring;
  }
}

}  // namespace understory::landmark_extractor::trunks
