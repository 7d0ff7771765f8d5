#include "common/place_recognition/landmark_pairs.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/alignment.hpp"

namespace understory::place_recognition {
namespace {

constexpr int kMostRounds = 10;
/// Standard deviations of the prior that keeps the information of few pairs invertible.
constexpr double kPriorSigmaM = 100.0;
constexpr double kPriorSigmaRad = 10.0;

double residual_m(const LandmarkSets& landmarks, const geometry::SE2& frame_T_query,
                  const LandmarkPair& pair) {
  return (frame_T_query * landmarks.query[pair.query].position_m -
          landmarks.frame[pair.frame].position_m)
      .norm();
}

std::vector<LandmarkPair> agreeing(const LandmarkSets& landmarks, const geometry::SE2& pose,
                                   std::span<const LandmarkPair> pairs, double gate_m) {
  std::vector<LandmarkPair> found;
  for (const LandmarkPair& pair : pairs) {
    if (residual_m(landmarks, pose, pair) <= gate_m) found.push_back(pair);
  }
  return found;
}

/// Index of the nearest point to `at`, and its squared distance.
std::pair<std::uint32_t, double> nearest(std::span<const Eigen::Vector2d> points,
                                         const Eigen::Vector2d& at) {
  std::pair<std::uint32_t, double> best{0, std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double squared = (points[i] - at).squaredNorm();
    if (squared < best.second) best = {static_cast<std::uint32_t>(i), squared};
  }
  return best;
}

}  // namespace

geometry::SE2 aligned_pose(const LandmarkSets& landmarks, std::span<const LandmarkPair> pairs) {
  geometry::RigidAlignment2 alignment;
  for (const LandmarkPair& pair : pairs)
    alignment.add(landmarks.frame[pair.frame].position_m, landmarks.query[pair.query].position_m);
  return alignment.a_T_b();
}

std::optional<PairedPose> most_agreed(const LandmarkSets& landmarks,
                                      std::span<const LandmarkPair> pairs, double gate_m) {
  std::vector<LandmarkPair> best;
  for (std::size_t a = 0; a < pairs.size(); ++a) {
    for (std::size_t b = a + 1; b < pairs.size(); ++b) {
      if (pairs[a].query == pairs[b].query || pairs[a].frame == pairs[b].frame) continue;
      const geometry::SE2 pose = aligned_pose(landmarks, std::vector{pairs[a], pairs[b]});
      auto found = agreeing(landmarks, pose, pairs, gate_m);
      if (found.size() > best.size()) best = std::move(found);
    }
  }
  if (best.size() < 2) return std::nullopt;
  return PairedPose{aligned_pose(landmarks, best), std::move(best)};
}

std::vector<LandmarkPair> mutual_pairs(const LandmarkSets& landmarks,
                                       const geometry::SE2& frame_T_query, double gate_m) {
  const Eigen::Matrix2d rotation = frame_T_query.rotation();
  std::vector<Eigen::Vector2d> moved;
  moved.reserve(landmarks.query.size());
  for (const LevelStem& stem : landmarks.query)
    moved.emplace_back(rotation * stem.position_m + frame_T_query.translation());
  std::vector<Eigen::Vector2d> fixed;
  fixed.reserve(landmarks.frame.size());
  for (const LevelStem& stem : landmarks.frame) fixed.push_back(stem.position_m);

  std::vector<LandmarkPair> pairs;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const auto [j, squared] = nearest(fixed, moved[i]);
    if (squared > gate_m * gate_m || nearest(moved, fixed[j]).first != i) continue;
    pairs.push_back({static_cast<std::uint32_t>(i), j});
  }
  return pairs;
}

PairedPose refined_pose(const LandmarkSets& landmarks, const geometry::SE2& start, double gate_m) {
  const auto same = [](const LandmarkPair& a, const LandmarkPair& b) {
    return a.query == b.query && a.frame == b.frame;
  };
  PairedPose pose{start, {}};
  for (int round = 0; round < kMostRounds; ++round) {
    auto pairs = mutual_pairs(landmarks, pose.frame_T_query, gate_m);
    const bool is_same =
        std::equal(pairs.begin(), pairs.end(), pose.pairs.begin(), pose.pairs.end(), same);
    pose.pairs = std::move(pairs);
    if (is_same || pose.pairs.size() < 2) break;
    pose.frame_T_query = aligned_pose(landmarks, pose.pairs);
  }
  return pose;
}

Eigen::Matrix3d paired_covariance(const LandmarkSets& landmarks, const PairedPose& pose,
                                  double sigma_m) {
  // d(T Exp(xi) p) = R (xi_xy + theta perpendicular(p)); R cancels in the information.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  for (const LandmarkPair& pair : pose.pairs) {
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << Eigen::Matrix2d::Identity(),
        geometry::perpendicular(landmarks.query[pair.query].position_m);
    information += jacobian.transpose() * jacobian;
    const double residual = residual_m(landmarks, pose.frame_T_query, pair);
    squares += residual * residual;
  }

  const double freedom = 2.0 * static_cast<double>(pose.pairs.size()) - 3.0;
  const double shown = freedom > 0.0 ? squares / freedom : 0.0;
  information /= std::max(sigma_m * sigma_m, shown);
  const Eigen::Vector3d prior(1.0 / (kPriorSigmaM * kPriorSigmaM),
                              1.0 / (kPriorSigmaM * kPriorSigmaM),
                              1.0 / (kPriorSigmaRad * kPriorSigmaRad));
  if (pose.pairs.size() < 2) information.setZero();
  information.diagonal() += prior;
  return information.ldlt().solve(Eigen::Matrix3d::Identity());
}

std::vector<LevelStem> nearest_landmarks(std::span<const LevelStem> landmarks, std::size_t most) {
  std::vector<LevelStem> kept(landmarks.begin(), landmarks.end());
  if (kept.size() <= most) return kept;

  std::vector<double> squared;
  squared.reserve(kept.size());
  for (const LevelStem& stem : kept) squared.push_back(stem.position_m.squaredNorm());
  std::nth_element(squared.begin(), squared.begin() + static_cast<std::ptrdiff_t>(most),
                   squared.end());
  const double limit = squared[most];
  std::erase_if(kept,
                [&](const LevelStem& stem) { return stem.position_m.squaredNorm() >= limit; });
  return kept;
}

}  // namespace understory::place_recognition
