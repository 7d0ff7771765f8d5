#include "common/geometry/registration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/geometry/gated_points.hpp"

namespace understory::geometry {
namespace {

using Points = std::span<const UncertainPoint>;

struct Candidate {
  double rank;  ///< Minus twice the log likelihood, up to a constant.
  std::uint32_t reference;
  std::uint32_t observed;
};

/// Variance [m^2] that the pose's uncertainty adds to a point at `position` of the moving frame: an
/// isotropic bound.
double pose_variance(const Eigen::Matrix3d& covariance, const Eigen::Vector2d& position) {
  return std::max(covariance(0, 0), covariance(1, 1)) + position.squaredNorm() * covariance(2, 2);
}

constexpr double kBin_m = 2.0;
/// Limits of one round, above what any scene needs.
constexpr std::size_t kMostCandidates = 65536;
constexpr std::size_t kMostSearchCandidates = 8192;
constexpr std::size_t kMostSearched = 256;

class Registrar {
 public:
  Registrar(Points reference, Points observed, const RegistrationParameters& parameters,
            std::size_t most_candidates = kMostCandidates)
      : reference_(reference),
        observed_(observed),
        parameters_(parameters),
        most_candidates_(most_candidates) {
    const double widest_m = parameters.max_gate_m / parameters.gate_sigmas;
    gated_ = GatedPoints(kBin_m, widest_m * widest_m);
    for (const UncertainPoint& point : reference) gated_.add(point.position_m, point.variance_m2);
    gated_.sort();
  }

  Registration run(const SE2WithCovariance& guess) {
    if (reference_.empty() || observed_.empty()) return {guess.mean, guess.covariance, {}};
    guess_ = guess;
    information_ = guess.covariance.llt().solve(Eigen::Matrix3d::Identity());
    Registration result{guess_.mean, guess_.covariance, {}};
    std::vector<PointPair> previous;

    // Pair the unambiguous points and fit the pose to them, until the pairs stay the same.
    for (int round = 0; round < parameters_.max_rounds; ++round) {
      previous = result.pairs;
      result.pairs = unambiguous_pairs_at(result);
      if (result.pairs.empty()) break;
      refine(result);
      if (same(previous, result.pairs)) break;
    }

    result.pairs = pairs_at(result);
    return result;
  }

 private:
  static bool same(const std::vector<PointPair>& a, const std::vector<PointPair>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const PointPair& p, const PointPair& q) {
                        return p.reference == q.reference && p.observed == q.observed;
                      });
  }

  void collect_candidates(const Registration& at) {
    candidates_.clear();
    const double k2 = parameters_.gate_sigmas * parameters_.gate_sigmas;
    const double floor2 = parameters_.gate_floor_m * parameters_.gate_floor_m / k2;
    const Eigen::Matrix2d rotation = at.reference_T_observed.rotation();

    for (std::uint32_t i = 0; i < observed_.size(); ++i) {
      const Eigen::Vector2d& z = observed_[i].position_m;
      const double base = observed_[i].variance_m2 + pose_variance(at.covariance, z) + floor2;
      if (parameters_.gate_sigmas * std::sqrt(base) > parameters_.max_gate_m) continue;
      if (candidates_.size() >= most_candidates_) break;

      const Eigen::Vector2d p = rotation * z + at.reference_T_observed.translation();
      gated_.for_each_near(p, parameters_.gate_sigmas, base, [&](std::uint32_t r, double d2) {
        const double m2 = d2 / (base + reference_[r].variance_m2);
        if (m2 > k2) return;
        const double spread = 2.0 * std::log(base + reference_[r].variance_m2);
        candidates_.push_back({m2 + spread + reference_[r].reluctance, r, i});
      });
    }
  }

  void count_candidates() {
    reference_count_.assign(reference_.size(), 0);
    observed_count_.assign(observed_.size(), 0);
    for (const Candidate& c : candidates_) {
      ++reference_count_[c.reference];
      ++observed_count_[c.observed];
    }
  }

  bool is_ambiguous(const Candidate& c) const {
    return reference_count_[c.reference] > 1 || observed_count_[c.observed] > 1;
  }

  /// Pairs in which neither point has another candidate, in order of `observed`.
  std::vector<PointPair> unambiguous_pairs_at(const Registration& at) {
    collect_candidates(at);
    count_candidates();
    std::vector<PointPair> pairs;
    for (const Candidate& c : candidates_) {
      if (!is_ambiguous(c)) pairs.push_back({c.reference, c.observed, false});
    }
    return pairs;
  }

  /// One to one, likeliest first. A pair is ambiguous where either point had another candidate.
  std::vector<PointPair> pairs_at(const Registration& at) {
    // The candidates inside the gates, likeliest first; ties go by index.
    collect_candidates(at);
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      if (a.rank != b.rank) return a.rank < b.rank;
      return a.observed != b.observed ? a.observed < b.observed : a.reference < b.reference;
    });

    count_candidates();

    // Each point is used once.
    reference_used_.assign(reference_.size(), false);
    observed_used_.assign(observed_.size(), false);
    std::vector<PointPair> pairs;
    for (const Candidate& c : candidates_) {
      if (reference_used_[c.reference] || observed_used_[c.observed]) continue;
      reference_used_[c.reference] = observed_used_[c.observed] = true;
      pairs.push_back({c.reference, c.observed, is_ambiguous(c)});
    }

    std::sort(pairs.begin(), pairs.end(),
              [](const PointPair& a, const PointPair& b) { return a.observed < b.observed; });
    return pairs;
  }

  /// Two Gauss-Newton steps on the pairs and the guess.
  void refine(Registration& result) const {
    for (int step = 0; step < 2; ++step) {
      // The guess.
      const SE2& pose = result.reference_T_observed;
      const Eigen::Vector3d off = (guess_.mean.inverse() * pose).Log();
      Eigen::Matrix3d hessian = information_;
      Eigen::Vector3d gradient = information_ * off;

      // The pairs: errors in the observed frame.
      const Eigen::Matrix2d to_observed = pose.rotation().transpose();
      for (const PointPair& pair : result.pairs) {
        const UncertainPoint& a = reference_[pair.reference];
        const UncertainPoint& b = observed_[pair.observed];
        const double weight = 1.0 / (a.variance_m2 + b.variance_m2 + 1e-12);
        const Eigen::Vector2d error =
            b.position_m - to_observed * (a.position_m - pose.translation());
        Eigen::Matrix<double, 2, 3> jacobian;
        jacobian << Eigen::Matrix2d::Identity(), perpendicular(b.position_m);
        hessian.noalias() += weight * jacobian.transpose() * jacobian;
        gradient.noalias() += weight * jacobian.transpose() * error;
      }

      const Eigen::LLT<Eigen::Matrix3d> llt(hessian);
      result.reference_T_observed = pose * SE2::Exp(-llt.solve(gradient));
      result.covariance = llt.solve(Eigen::Matrix3d::Identity());
    }
  }

  Points reference_;
  Points observed_;
  SE2WithCovariance guess_;
  RegistrationParameters parameters_;
  std::size_t most_candidates_;
  GatedPoints gated_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> reference_count_, observed_count_;
  std::vector<bool> reference_used_, observed_used_;
};

/// The points nearest to the observer, in their given order; all points where they are few.
std::vector<UncertainPoint> nearest_points(Points points) {
  std::vector<UncertainPoint> result(points.begin(), points.end());
  if (points.size() <= kMostSearched) return result;
  std::vector<double> distances;
  for (const UncertainPoint& point : points) distances.push_back(point.position_m.squaredNorm());
  const auto last = distances.begin() + (kMostSearched - 1);
  std::nth_element(distances.begin(), last, distances.end());
  const double limit = *last;
  std::erase_if(result, [limit](const UncertainPoint& point) {
    return point.position_m.squaredNorm() > limit;
  });
  if (result.size() > kMostSearched) result.resize(kMostSearched);
  return result;
}

}  // namespace

Registration register_points(Points reference, Points observed, const SE2WithCovariance& guess,
                             const RegistrationParameters& parameters) {
  if (reference.empty() || observed.empty()) return {guess.mean, guess.covariance, {}};
  return Registrar(reference, observed, parameters).run(guess);
}

Registration register_step(Points reference, Points observed, const SE2& last, const SE2& last_step,
                           const StepModel& model, const RegistrationParameters& parameters,
                           const std::function<bool(const Registration&)>& fits) {
  const double t2 = model.sigma_m * model.sigma_m;
  const double r2 = model.sigma_rad * model.sigma_rad;
  const Eigen::Matrix3d covariance = Eigen::Vector3d(t2, t2, r2).asDiagonal();

  // First guess: the last step repeats.
  Registrar all(reference, observed, parameters);
  Registration best = all.run({last * last_step, covariance});
  if (fits(best)) return best;

  // It did not repeat: try rotations on the spot with the nearest points.
  const std::vector<UncertainPoint> nearest = nearest_points(observed);
  const bool has_all = nearest.size() == observed.size();
  Registrar search(reference, nearest, parameters, kMostSearchCandidates);
  Registration found = has_all ? best : search.run({last * last_step, covariance});
  std::optional<SE2> best_rotation;
  const int steps = static_cast<int>(std::ceil(model.max_rotation_rad / model.sigma_rad));
  for (int step = -steps; step <= steps; ++step) {
    const SE2 rotated = last * SE2(0.0, 0.0, step * model.sigma_rad);
    Registration tried = search.run({rotated, covariance});
    if (tried.pairs.size() < model.min_searched_pairs) continue;
    if (tried.pairs.size() <= found.pairs.size()) continue;
    found = std::move(tried);
    best_rotation = rotated;
  }

  // Register the best one with all points.
  if (has_all) return found;
  if (best_rotation) best = all.run({*best_rotation, covariance});
  return best;
}

}  // namespace understory::geometry
