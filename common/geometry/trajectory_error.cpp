#include "common/geometry/trajectory_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/geometry/alignment.hpp"

namespace understory::geometry {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Length of the true path from the first pose to each pose [m].
std::vector<double> paths_m(std::span<const PosePair> poses) {
  std::vector<double> paths(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Eigen::Vector2d step = poses[i].truth.translation() - poses[i - 1].truth.translation();
    paths[i] = paths[i - 1] + step.norm();
  }
  return paths;
}

/// The later pose whose path from `from` is nearest to `length_m`; of equal ones the first.
std::optional<std::size_t> pose_after(const std::vector<double>& paths_m, std::size_t from,
                                      double length_m) {
  const auto behind = paths_m.begin() + static_cast<std::ptrdiff_t>(from) + 1;
  if (behind == paths_m.end()) return std::nullopt;
  const double wanted_m = paths_m[from] + length_m;
  auto best = std::lower_bound(behind, paths_m.end(), wanted_m);
  if (best != behind) {
    const auto shorter = std::lower_bound(behind, best, *std::prev(best));
    if (best == paths_m.end() || wanted_m - *shorter <= *best - wanted_m) best = shorter;
  }

  if (std::abs(*best - wanted_m) > kPathTolerance * length_m) return std::nullopt;
  return static_cast<std::size_t>(best - paths_m.begin());
}

/// Root mean square, from the sum of the squares.
double root_mean(double sum_of_squares, std::size_t count) {
  return std::sqrt(sum_of_squares / static_cast<double>(count));
}

}  // namespace

std::optional<AbsoluteError> aligned_error(std::span<const PosePair> poses) {
  if (poses.size() < 3) return std::nullopt;
  RigidAlignment2 alignment;
  for (const PosePair& pose : poses)
    alignment.add(pose.truth.translation(), pose.estimate.translation());
  const SE2 truth_T_estimate = alignment.a_T_b();

  AbsoluteError error;
  double squares = 0.0;
  for (const PosePair& pose : poses) {
    const Eigen::Vector2d off =
        pose.truth.translation() - truth_T_estimate * pose.estimate.translation();
    squares += off.squaredNorm();
    error.largest_m = std::max(error.largest_m, off.norm());
  }
  error.rms_m = root_mean(squares, poses.size());
  return error;
}

std::optional<RelativeError> relative_error(std::span<const PosePair> poses, double length_m) {
  const std::vector<double> paths = paths_m(poses);
  RelativeError error;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto j = pose_after(paths, i, length_m);
    if (!j || poses[i].map_id != poses[*j].map_id) continue;

    const SE2 true_motion = poses[i].truth.inverse() * poses[*j].truth;
    const SE2 motion = poses[i].estimate.inverse() * poses[*j].estimate;
    const SE2 off = true_motion.inverse() * motion;
    const double path_m = paths[*j] - paths[i];
    const double angle_deg = kDegrees * std::abs(off.theta());

    ++error.pairs;
    error.translation_rms_m += off.translation().squaredNorm();
    error.translation_mean_percent += 100.0 * off.translation().norm() / path_m;
    error.rotation_rms_deg += angle_deg * angle_deg;
    error.rotation_mean_deg_per_m += angle_deg / path_m;
  }

  if (error.pairs == 0) return std::nullopt;
  error.translation_rms_m = root_mean(error.translation_rms_m, error.pairs);
  error.rotation_rms_deg = root_mean(error.rotation_rms_deg, error.pairs);
  error.translation_mean_percent /= static_cast<double>(error.pairs);
  error.rotation_mean_deg_per_m /= static_cast<double>(error.pairs);
  return error;
}

Eigen::Matrix3d covariance_of_truth(const TruthSigma& sigma,
                                    const std::optional<SE2>& tie_T_vehicle) {
  Eigen::Matrix3d of_one = Eigen::Vector3d(sigma.position_m, sigma.position_m, sigma.heading_rad)
                               .array()
                               .square()
                               .matrix()
                               .asDiagonal();
  if (!tie_T_vehicle) return of_one;
  const Eigen::Matrix3d moved = tie_T_vehicle->inverse().Adjoint();
  return of_one + moved * of_one * moved.transpose();
}

std::optional<double> nees(const PosePair& pose, const Eigen::Matrix3d& covariance) {
  const Eigen::LLT<Eigen::Matrix3d> root(covariance);
  if (!covariance.allFinite() || root.info() != Eigen::Success) return std::nullopt;
  const Eigen::Vector3d error = (pose.estimate.inverse() * pose.truth).Log();
  const double value = error.dot(root.solve(error));
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<NeesSummary> summary_of(std::vector<double> nees) {
  if (nees.empty()) return std::nullopt;
  NeesSummary summary;
  summary.count = nees.size();
  const auto count = static_cast<double>(nees.size());
  for (const double value : nees) {
    summary.mean += value / count;
    if (value > kNeesBandHigh) summary.share_above += 1.0 / count;
    if (value >= kNeesBandLow && value <= kNeesBandHigh) summary.share_in_band += 1.0 / count;
  }

  const auto middle = nees.begin() + static_cast<std::ptrdiff_t>(nees.size() / 2);
  std::nth_element(nees.begin(), middle, nees.end());
  summary.median = *middle;
  if (nees.size() % 2 == 0)
    summary.median = 0.5 * (summary.median + *std::max_element(nees.begin(), middle));
  return summary;
}

}  // namespace understory::geometry
