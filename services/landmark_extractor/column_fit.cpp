#include "services/landmark_extractor/column_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace understory {
namespace {

/// More evidence than this costs time and adds nothing beyond the shape's own uncertainty.
constexpr std::size_t kMaxRuns = 10;
constexpr std::size_t kHitsPerRun = 7;
constexpr int kIterations = 8;
/// The next step of the estimate would be smaller by far than this one's square.
constexpr double kSettled_m2 = 4e-7;
/// Beams that graze the stem more than this (part of the radius) say little of its range.
constexpr double kMaxGraze = 0.9;
/// Residuals beyond this many sigma weigh as those at it (Huber).
constexpr double kHuber = 2.0;
/// A run disagrees whose ranges are so far off in root mean square, or an edge of it [sigma].
constexpr double kMaxRunResidual = 2.5;
constexpr double kMaxEdgeResidual = 3.5;
constexpr std::size_t kChecksPerRun = 4;
constexpr int kRounds = 4;
/// Runs of one stem seem so far apart, and so much more per metre of height.
constexpr float kConsensus_m = 0.06F;
constexpr float kConsensusLean = 0.06F;

double square(double value) { return value * value; }

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// One residual with its derivative by (x, y, radius) at its own height.
struct Term {
  double residual = 0.0;
  Eigen::Vector3d jacobian = Eigen::Vector3d::Zero();
  double variance = 1.0;

  /// In standard deviations.
  double squared() const { return residual * residual / variance; }
};

/// Where a beam meets a circle.
Term hit_term(const Eigen::Vector3d& circle, const Sight& sight, double range,
              const SweepParameters& sweep, double roundness) {
  const Eigen::Vector2d& direction = sight.direction;
  const Eigen::Vector2d to_centre = circle.head<2>() - sight.origin_m;
  const double along = direction.dot(to_centre);
  const double miss = cross(direction, to_centre);
  const double radius = std::max(circle[2], 1e-3);
  const double limit = kMaxGraze * radius;
  const double m = std::clamp(miss, -limit, limit);
  const double inverse_q = 1.0 / std::sqrt(square(radius) - square(m));
  const double tangent = m * inverse_q;
  Term term;
  // The half chord is (radius^2 - m^2) / q.
  term.residual = range - along + (square(radius) - square(m)) * inverse_q;
  term.jacobian = {direction.x() - tangent * direction.y(), direction.y() + tangent * direction.x(),
                   -radius * inverse_q};
  // A footprint of some width on a slanting surface smears the range.
  term.variance = square(sweep.range_sigma_m) + square(roundness) +
                  square(tangent * along * sweep.beam_width_rad);
  // Nearer to the edge the range falls off so steeply that only the edge itself says something.
  if (std::abs(miss) > limit) term.variance += square(radius);
  return term;
}

/// How far the line of sight passes from the circle on its own side.
Term edge_term(const Eigen::Vector3d& circle, const Sight& sight, double side, double sigma) {
  Term term;
  term.residual = -(cross(sight.direction, circle.head<2>() - sight.origin_m) + side * circle[2]);
  term.jacobian = {-sight.direction.y(), sight.direction.x(), side};
  term.variance = square(sigma);
  return term;
}

Eigen::Vector3d circle_at(const Vector6d& state, double above) {
  return state.head<3>() + above * state.tail<3>();
}

/// Sums over residuals of the circle at their heights: information and gradient of the stem follow.
class Sums {
 public:
  void add(const Term& term, double above) {
    double weight = 1.0 / term.variance;
    const double squared = square(term.residual) * weight;
    if (squared > square(kHuber)) weight *= kHuber / std::sqrt(squared);
    const double x = term.jacobian[0];
    const double y = term.jacobian[1];
    const double r = term.jacobian[2];
    const double wx = weight * x;
    const double wy = weight * y;
    const double wr = weight * r;
    const std::array<double, kTerms> terms{wx * x,
                                           wx * y,
                                           wx * r,
                                           wy * y,
                                           wy * r,
                                           wr * r,
                                           wx * term.residual,
                                           wy * term.residual,
                                           wr * term.residual};
    for (std::size_t i = 0; i < kTerms; ++i) {
      sums_[0][i] += terms[i];
      sums_[1][i] += above * terms[i];
      sums_[2][i] += above * above * terms[i];
    }
  }

  Matrix6d information() const {
    Matrix6d result;
    result << block(0), block(1), block(1), block(2);
    return result;
  }
  Vector6d gradient() const {
    Vector6d result;
    for (int i = 0; i < 3; ++i) {
      result[i] = sums_[0][6 + static_cast<std::size_t>(i)];
      result[i + 3] = sums_[1][6 + static_cast<std::size_t>(i)];
    }
    return result;
  }

 private:
  /// The upper triangle of the information, row by row, then the gradient.
  static constexpr std::size_t kTerms = 9;

  Eigen::Matrix3d block(std::size_t power) const {
    const std::array<double, kTerms>& s = sums_[power];
    Eigen::Matrix3d result;
    result << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return result;
  }

  std::array<std::array<double, kTerms>, 3> sums_{};  ///< Times 1, h, h^2.
};

}  // namespace

std::optional<StemFit> StemFitter::fit(const RingCloud& cloud, const std::vector<Run>& runs,
                                       const Column& column) {
  start_with_consensus(runs, column);
  StemFit fit;
  Vector6d state = Vector6d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    choose_runs();
    take_evidence(cloud, runs);
    if (round == 0) state = start(cloud, runs);
    if (!settle(state)) return std::nullopt;
    if (!sort_out(cloud, runs, column, state)) break;
    if (agreeing_.empty()) return std::nullopt;
  }
  describe(state, runs, fit);
  return fit;
}

/// The largest group of runs with nearly the same centre, counted in points.
void StemFitter::start_with_consensus(const std::vector<Run>& runs, const Column& column) {
  const std::size_t count = std::min(column.runs.size(), kMaxRuns);
  const auto near = [&](const Run& a, const Run& b) {
    const float x = a.x_m - b.x_m;
    const float y = a.y_m - b.y_m;
    const float limit = kConsensus_m + kConsensusLean * std::abs(a.z_m - b.z_m);
    return x * x + y * y < limit * limit;
  };
  std::size_t most = 0;
  std::uint32_t best = column.runs.front();
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t candidate = column.runs[k * column.runs.size() / count];
    std::size_t points = 0;
    for (const std::uint32_t i : column.runs) {
      if (near(runs[candidate], runs[i])) points += runs[i].size();
    }
    if (points > most) {
      most = points;
      best = candidate;
    }
  }
  agreeing_.clear();
  for (const std::uint32_t i : column.runs) {
    if (near(runs[best], runs[i])) agreeing_.push_back(i);
  }
}

/// At most kMaxRuns of the agreeing runs, spread over the height.
void StemFitter::choose_runs() {
  used_.clear();
  const std::size_t count = std::min(agreeing_.size(), kMaxRuns);
  for (std::size_t k = 0; k < count; ++k) {
    used_.push_back(agreeing_[k * agreeing_.size() / count]);
  }
}

void StemFitter::take_evidence(const RingCloud& cloud, const std::vector<Run>& runs) {
  hits_.clear();
  edges_.clear();
  for (const std::uint32_t index : used_) {
    const Run& run = runs[index];
    const std::size_t count = std::min(run.size(), kHitsPerRun);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = run.first + (2 * k + 1) * run.size() / (2 * count);
      const RingPoint& point = cloud.points()[i];
      hits_.push_back({cloud.sight(point), point.range_m, point.z_m, index});
    }
    if (run.left == Border::kClear) edges_.push_back(edge_of(cloud, run, index, 1.0));
    if (run.right == Border::kClear) edges_.push_back(edge_of(cloud, run, index, -1.0));
  }
  share_edges();
}

/// The edge lies somewhere between the run's last beam and the next.
StemFitter::Edge StemFitter::edge_of(const RingCloud& cloud, const Run& run, std::uint32_t index,
                                     double side) const {
  const RingPoint& last = cloud.points()[side > 0.0 ? run.last : run.first];
  const double step = cloud.step_rad(run.ring);
  const double beyond = side * (0.5 * step - sweep_.beam_width_rad);
  Sight sight = cloud.sight(last);
  sight.direction += beyond * Eigen::Vector2d(-sight.direction.y(), sight.direction.x());
  sight.direction.normalize();
  const double variance =
      square(last.range_m) * (square(step) / 12.0 + square(0.5 * sweep_.beam_width_rad)) +
      square(trunk_.roundness_sigma_m);
  return {sight, last.z_m, side, std::sqrt(variance), index};
}

/// Rings that fire at the same azimuths miss an upright edge by the same part of a step: together
/// they say no more than one does.
void StemFitter::share_edges() {
  shares_.assign(edges_.size(), 0.0);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    for (const Edge& other : edges_) {
      if (other.side != edges_[i].side) continue;
      const double apart = std::abs(cross(edges_[i].sight.direction, other.sight.direction));
      const double range_sigma = edges_[i].sigma_m;
      const double distance = apart * hits_.front().range_m;
      if (distance < range_sigma) shares_[i] += 1.0;
    }
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    edges_[i].sigma_m *= std::sqrt(std::max(1.0, shares_[i]));
  }
}

/// From the longest run: its width gives the radius.
Vector6d StemFitter::start(const RingCloud& cloud, const std::vector<Run>& runs) const {
  const auto longest = std::max_element(
      used_.begin(), used_.end(),
      [&](std::uint32_t a, std::uint32_t b) { return runs[a].size() < runs[b].size(); });
  const Run& run = runs[*longest];
  const double radius =
      std::clamp(0.5 * static_cast<double>(run.width_m), trunk_.min_radius_m, trunk_.max_radius_m);
  const RingPoint& middle = cloud.points()[(run.first + run.last) / 2];
  const Sight sight = cloud.sight(middle);
  Vector6d state = Vector6d::Zero();
  state.head<2>() = sight.origin_m + (run.nearest_m + radius) * sight.direction;
  state[2] = radius;
  state[5] = trunk_.prior_taper;
  return state;
}

void StemFitter::linearise(const Vector6d& state, Matrix6d& information, Vector6d& gradient) {
  Sums sums;
  for (const Hit& hit : hits_) {
    const double above = hit.z_m - reference_z_m_;
    sums.add(
        hit_term(circle_at(state, above), hit.sight, hit.range_m, sweep_, trunk_.roundness_sigma_m),
        above);
  }
  for (const Edge& edge : edges_) {
    const double above = edge.z_m - reference_z_m_;
    sums.add(edge_term(circle_at(state, above), edge.sight, edge.side, edge.sigma_m), above);
  }
  information = sums.information();
  gradient = sums.gradient();
  const auto prior = [&](int at, double mean, double sigma) {
    information(at, at) += 1.0 / square(sigma);
    gradient[at] += (mean - state[at]) / square(sigma);
  };
  prior(2, trunk_.prior_radius_m, trunk_.prior_radius_sigma_m);
  prior(3, 0.0, trunk_.prior_lean_sigma_rad);
  prior(4, 0.0, trunk_.prior_lean_sigma_rad);
  prior(5, trunk_.prior_taper, trunk_.prior_taper_sigma);
}

bool StemFitter::settle(Vector6d& state) {
  double z = 0.0;
  for (const Hit& hit : hits_) z += hit.z_m;
  const double reference = z / static_cast<double>(hits_.size());
  state.head<3>() += (reference - reference_z_m_) * state.tail<3>();
  reference_z_m_ = reference;
  Matrix6d information;
  Vector6d gradient;
  for (int i = 0; i < kIterations; ++i) {
    linearise(state, information, gradient);
    const Vector6d change = information.ldlt().solve(gradient);
    state += change;
    state[2] = std::clamp(state[2], 0.5 * trunk_.min_radius_m, 2.0 * trunk_.max_radius_m);
    if (!state.allFinite()) return false;
    if (change.head<3>().squaredNorm() < kSettled_m2) break;
  }
  const Hit& any = hits_.front();
  return (state.head<2>() - any.sight.origin_m).dot(any.sight.direction) > 1.1 * state[2];
}

bool StemFitter::sort_out(const RingCloud& cloud, const std::vector<Run>& runs,
                          const Column& column, const Vector6d& state) {
  still_agreeing_.clear();
  for (const std::uint32_t index : column.runs) {
    if (agrees(cloud, runs[index], state)) still_agreeing_.push_back(index);
  }
  const bool is_new = still_agreeing_ != agreeing_;
  std::swap(agreeing_, still_agreeing_);
  return is_new;
}

/// A few of its ranges, and its edges, are where the stem has them.
bool StemFitter::agrees(const RingCloud& cloud, const Run& run, const Vector6d& state) const {
  const std::size_t count = std::min(run.size(), kChecksPerRun);
  double sum = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const RingPoint& point = cloud.points()[run.first + (2 * k + 1) * run.size() / (2 * count)];
    const Term term = hit_term(circle_at(state, point.z_m - reference_z_m_), cloud.sight(point),
                               point.range_m, sweep_, trunk_.roundness_sigma_m);
    sum += term.squared();
  }
  if (sum > square(kMaxRunResidual) * static_cast<double>(count)) return false;
  const auto edge_agrees = [&](double side) {
    const Edge edge = edge_of(cloud, run, 0, side);
    const Term term =
        edge_term(circle_at(state, edge.z_m - reference_z_m_), edge.sight, side, edge.sigma_m);
    return term.squared() < square(kMaxEdgeResidual);
  };
  return (run.left != Border::kClear || edge_agrees(1.0)) &&
         (run.right != Border::kClear || edge_agrees(-1.0));
}

void StemFitter::describe(const Vector6d& state, const std::vector<Run>& runs, StemFit& fit) {
  fit.state = state;
  fit.reference_z_m = reference_z_m_;
  Matrix6d information;
  Vector6d gradient;
  linearise(state, information, gradient);
  fit.covariance = information.inverse();
  double sum = 0.0;
  for (const Hit& hit : hits_) {
    sum += hit_term(circle_at(state, hit.z_m - reference_z_m_), hit.sight, hit.range_m, sweep_,
                    trunk_.roundness_sigma_m)
               .squared();
  }
  for (const Edge& edge : edges_) {
    sum +=
        edge_term(circle_at(state, edge.z_m - reference_z_m_), edge.sight, edge.side, edge.sigma_m)
            .squared();
    (edge.side > 0.0 ? fit.sees_left : fit.sees_right) = true;
  }
  fit.mean_square_residual = sum / static_cast<double>(hits_.size() + edges_.size());
  fit.low_z_m = runs[agreeing_.front()].z_m;
  fit.high_z_m = runs[agreeing_.back()].z_m;
  std::uint16_t ring = 0xffff;
  for (const std::uint32_t index : agreeing_) {
    fit.points += runs[index].size();
    if (runs[index].ring != ring) ++fit.rings;
    ring = runs[index].ring;
  }
}

}  // namespace understory
