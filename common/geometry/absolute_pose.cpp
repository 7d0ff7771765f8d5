#include "common/geometry/absolute_pose.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace understory::geometry {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Sine of the angle between bearing and prediction; 1 where the point is behind.
double sine_error(const PointSighting& pair, const Eigen::Isometry3d& camera_T_map) {
  const Eigen::Vector3d at = camera_T_map * pair.point_m;
  const double length = at.norm();
  if (!(pair.bearing.dot(at) > 0.0)) return 1.0;
  return pair.bearing.cross(at).norm() / length;
}

/// Truncated sum of squares.
double msac_score(std::span<const PointSighting> pairs, const Eigen::Isometry3d& pose,
                  double threshold, double give_up) {
  double sum = 0.0;
  for (const PointSighting& pair : pairs) {
    const double error = sine_error(pair, pose);
    sum += std::min(error * error, threshold * threshold);
    if (sum > give_up) break;
  }
  return sum;
}

std::vector<std::uint32_t> inliers_of(std::span<const PointSighting> pairs,
                                      const Eigen::Isometry3d& pose, double threshold) {
  std::vector<std::uint32_t> inliers;
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    if (sine_error(pairs[i], pose) < threshold) inliers.push_back(i);
  }
  return inliers;
}

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// The pose with exp of a rotation vector and a translation applied on the left.
Eigen::Isometry3d perturbed(const Eigen::Isometry3d& pose, const Vector6& step) {
  const Eigen::Vector3d rotation = step.head<3>();
  const double angle = rotation.norm();
  const Eigen::Vector3d axis = angle > 0.0 ? (rotation / angle).eval() : Eigen::Vector3d::UnitX();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis).toRotationMatrix();

  Eigen::Isometry3d result;
  result.linear() =
      Eigen::Quaterniond(Eigen::Matrix3d(turn * pose.linear())).normalized().toRotationMatrix();
  result.translation() = turn * pose.translation() + step.tail<3>();
  return result;
}

/// Normal equations of the errors in the tangent planes of the bearings.
struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double squares = 0.0;

  void add(const PointSighting& pair, const Eigen::Isometry3d& pose, double weight = 1.0) {
    const Eigen::Vector3d at = pose * pair.point_m;
    const double range = at.norm();
    if (range < 1e-9) return;
    const Eigen::Vector3d direction = at / range;
    Eigen::Matrix<double, 2, 3> plane;
    plane.row(0) = pair.bearing.unitOrthogonal().transpose();
    plane.row(1) = pair.bearing.cross(plane.row(0).transpose()).transpose();

    Eigen::Matrix<double, 3, 6> motion;
    motion << -skew(at), Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d flat =
        (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / range;
    const Eigen::Matrix<double, 2, 6> jacobian = plane * flat * motion;
    const Eigen::Vector2d residual = plane * direction;
    information += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * residual;
    squares += weight * residual.squaredNorm();
  }
};

NormalEquations equations_at(std::span<const PointSighting> pairs,
                             std::span<const std::uint32_t> used, const Eigen::Isometry3d& pose) {
  NormalEquations equations;
  for (const std::uint32_t i : used) equations.add(pairs[i], pose);
  return equations;
}

/// Number of samples after which one without a wrong pair was drawn with this confidence.
double samples_needed(double inlier_share, double confidence) {
  const double good = inlier_share * inlier_share * inlier_share;
  if (good >= 1.0) return 1.0;
  if (good <= 0.0) return std::numeric_limits<double>::infinity();
  return std::log(1.0 - confidence) / std::log1p(-good);
}

std::array<PointSighting, 3> draw_three(std::span<const PointSighting> pairs,
                                        std::mt19937_64& random) {
  std::uniform_int_distribution<std::size_t> draw(0, pairs.size() - 1);
  const std::size_t a = draw(random);
  std::size_t b = draw(random);
  while (b == a) b = draw(random);
  std::size_t c = draw(random);
  while (c == a || c == b) c = draw(random);
  return {pairs[a], pairs[b], pairs[c]};
}

/// Alternates least squares and the choice of inliers.
void settle(std::span<const PointSighting> pairs, const AbsolutePoseParameters& parameters,
            AbsolutePose& result) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    result.inliers = inliers_of(pairs, result.camera_T_map, parameters.threshold_rad);
    if (result.inliers.size() < std::max<std::size_t>(3, parameters.min_inliers)) return;
    result.camera_T_map = refine_absolute_pose(pairs, result.inliers, result.camera_T_map);
  }
  result.inliers = inliers_of(pairs, result.camera_T_map, parameters.threshold_rad);
}

/// The step with which perturbed() moves `from` to `to`.
Vector6 step_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  const Eigen::Matrix3d turn = to.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  Vector6 step;
  step << rotation.angle() * rotation.axis(), to.translation() - turn * from.translation();
  return step;
}

/// Pairs and prior: the cost that update_absolute_pose() minimises.
class WeighedPairs {
 public:
  WeighedPairs(std::span<const PointSighting> pairs, std::span<const double> weights,
               const PosePrior& prior, const AbsolutePoseParameters& parameters)
      : pairs_(pairs),
        weights_(weights),
        prior_(prior),
        parameters_(parameters),
        prior_information_(prior.covariance.ldlt().solve(Matrix6::Identity())) {}

  /// Minus twice the logarithm of the likelihood, up to a constant.
  double cost(const Eigen::Isometry3d& pose) const {
    const double threshold = parameters_.threshold_rad;
    double squares = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double error = sine_error(pairs_[i], pose);
      squares += weights_[i] * std::min(error * error, threshold * threshold);
    }
    const Vector6 from_prior = step_between(prior_.camera_T_map, pose);
    return squares / variance() + from_prior.dot(prior_information_ * from_prior);
  }

  /// Gauss-Newton over the pairs that fit; the choice is renewed at each step.
  Eigen::Isometry3d settled(Eigen::Isometry3d pose) const {
    constexpr int kSteps = 8;
    for (int i = 0; i < kSteps; ++i) {
      const NormalEquations fitting = equations(pose);
      const Vector6 from_prior = step_between(prior_.camera_T_map, pose);
      const Vector6 gradient = fitting.gradient / variance() + prior_information_ * from_prior;
      const Vector6 step = -information(fitting).ldlt().solve(gradient);
      if (!step.allFinite()) break;
      pose = perturbed(pose, step);
      if (step.squaredNorm() < 1e-16) break;
    }
    return pose;
  }

  Matrix6 covariance(const Eigen::Isometry3d& pose) const {
    return information(equations(pose)).ldlt().solve(Matrix6::Identity());
  }

 private:
  double variance() const { return parameters_.sigma_rad * parameters_.sigma_rad; }
  Matrix6 information(const NormalEquations& fitting) const {
    return fitting.information / variance() + prior_information_;
  }
  NormalEquations equations(const Eigen::Isometry3d& pose) const {
    NormalEquations fitting;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (sine_error(pairs_[i], pose) < parameters_.threshold_rad)
        fitting.add(pairs_[i], pose, weights_[i]);
    }
    return fitting;
  }

  std::span<const PointSighting> pairs_;
  std::span<const double> weights_;
  const PosePrior& prior_;
  const AbsolutePoseParameters& parameters_;
  Matrix6 prior_information_;
};

/// The pose of least cost among the prior and the poses of samples.
Eigen::Isometry3d best_guess(std::span<const PointSighting> pairs, const WeighedPairs& weighed,
                             const Eigen::Isometry3d& prior, int samples, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::Isometry3d best = prior;
  double least = weighed.cost(prior);
  for (int i = 0; i < samples; ++i) {
    for (const Eigen::Isometry3d& pose : solve_three_points(draw_three(pairs, random))) {
      const double cost = weighed.cost(pose);
      if (cost >= least) continue;
      least = cost;
      best = pose;
    }
  }
  return best;
}

}  // namespace

AbsolutePose update_absolute_pose(std::span<const PointSighting> pairs,
                                  std::span<const double> weights, const PosePrior& prior,
                                  const AbsolutePoseParameters& parameters, std::uint64_t seed) {
  const WeighedPairs weighed(pairs, weights, prior, parameters);
  AbsolutePose result;
  result.iterations = pairs.size() < 3 ? 0 : parameters.max_iterations;
  const Eigen::Isometry3d guess =
      best_guess(pairs, weighed, prior.camera_T_map, result.iterations, seed);

  const Eigen::Isometry3d from_guess = weighed.settled(guess);
  const Eigen::Isometry3d from_prior = weighed.settled(prior.camera_T_map);
  const bool is_guess_better = weighed.cost(from_guess) < weighed.cost(from_prior);
  result.camera_T_map = is_guess_better ? from_guess : from_prior;

  result.covariance = weighed.covariance(result.camera_T_map);
  result.inliers = inliers_of(pairs, result.camera_T_map, parameters.threshold_rad);
  result.is_found = result.inliers.size() >= parameters.min_inliers;
  if (result.inliers.empty()) return result;
  const NormalEquations fitting = equations_at(pairs, result.inliers, result.camera_T_map);
  result.rms_rad = std::sqrt(0.5 * fitting.squares / static_cast<double>(result.inliers.size()));
  return result;
}

Eigen::Isometry3d refine_absolute_pose(std::span<const PointSighting> pairs,
                                       std::span<const std::uint32_t> used,
                                       const Eigen::Isometry3d& guess) {
  constexpr int kSteps = 20;
  Eigen::Isometry3d pose = guess;
  NormalEquations here = equations_at(pairs, used, pose);
  double damping = 1e-6;

  for (int i = 0; i < kSteps; ++i) {
    Matrix6 damped = here.information;
    damped.diagonal() *= 1.0 + damping;
    const Vector6 step = -damped.ldlt().solve(here.gradient);
    if (!step.allFinite()) break;
    const Eigen::Isometry3d next = perturbed(pose, step);
    const NormalEquations there = equations_at(pairs, used, next);
    if (there.squares > here.squares) {
      damping *= 100.0;
      if (damping > 1e6) break;
      continue;
    }
    pose = next;
    here = there;
    damping = std::max(1e-9, 0.1 * damping);
    if (step.squaredNorm() < 1e-20) break;
  }
  return pose;
}

AbsolutePose find_absolute_pose(std::span<const PointSighting> pairs,
                                const AbsolutePoseParameters& parameters, std::uint64_t seed) {
  AbsolutePose result;
  if (pairs.size() < std::max<std::size_t>(3, parameters.min_inliers)) return result;
  std::mt19937_64 random(seed);
  double best = std::numeric_limits<double>::infinity();
  double needed = parameters.max_iterations;

  while (result.iterations < parameters.max_iterations && result.iterations < needed) {
    ++result.iterations;
    for (const Eigen::Isometry3d& pose : solve_three_points(draw_three(pairs, random))) {
      const double score = msac_score(pairs, pose, parameters.threshold_rad, best);
      if (score >= best) continue;
      best = score;
      result.camera_T_map = pose;
      const auto inliers = inliers_of(pairs, pose, parameters.threshold_rad);
      const double share = static_cast<double>(inliers.size()) / static_cast<double>(pairs.size());
      needed = samples_needed(share, parameters.confidence);
    }
  }

  settle(pairs, parameters, result);
  result.is_found = result.inliers.size() >= std::max<std::size_t>(3, parameters.min_inliers);
  if (!result.is_found) return result;
  const NormalEquations final_state = equations_at(pairs, result.inliers, result.camera_T_map);
  result.covariance = parameters.sigma_rad * parameters.sigma_rad *
                      final_state.information.ldlt().solve(Matrix6::Identity());
  result.rms_rad =
      std::sqrt(0.5 * final_state.squares / static_cast<double>(result.inliers.size()));
  return result;
}

}  // namespace understory::geometry
