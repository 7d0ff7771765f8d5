#include "eval/experiments/frontend/chain_limit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/plane/graph.hpp"
#include "common/model/odometry_buffer.hpp"

namespace understory::eval::experiments::frontend {
namespace {

namespace graph = factor_graph::graph;

constexpr double kMatch_m = 0.5;
/// A scan counts after so much motion.
constexpr double kMoved_m = 0.1;
constexpr double kRotated_rad = 0.02;
/// The first pose is the frame: known to a micrometre.
constexpr double kFixed = 1e12;
/// The gyro's bias: one scalar for so long, tied to the next one by its random walk.
constexpr double kBiasValidity_s = 5.0;
constexpr double kBiasWalk = 3e-5;  // [rad/s/sqrt(s)]
constexpr double kBiasSigma_rad_s = 1e-3;
/// Times that the noise of detections is taken from the residuals of the last solution.
constexpr int kNoiseRounds = 2;
constexpr double kLeastVariance = 1e-12;

/// All true landmarks with their kinds.
class TrueLandmarks {
 public:
  explicit TrueLandmarks(const sim::World& world) {
    for (const sim::TrueTrunk& trunk : world.trunks())
      places_m.emplace_back(trunk.centre_m.head<2>());
    first_corner_ = places_m.size();
    for (const sim::TrueCorner& corner : world.corners()) places_m.push_back(corner.position_m);
  }
  /// The nearest one of the kind within kMatch_m.
  std::optional<std::size_t> nearest(model::LandmarkKind kind, const Eigen::Vector2d& at_m) const {
    const bool is_trunk = kind == model::LandmarkKind::kTrunk;
    std::optional<std::size_t> best;
    double least = kMatch_m;
    const std::size_t end = is_trunk ? first_corner_ : places_m.size();
    for (std::size_t i = is_trunk ? 0 : first_corner_; i < end; ++i) {
      const double distance = (places_m[i] - at_m).norm();
      if (distance >= least) continue;
      least = distance;
      best = i;
    }
    return best;
  }

  std::vector<Eigen::Vector2d> places_m;

 private:
  std::size_t first_corner_ = 0;
};

/// The covariance with another variance of the heading; the correlations stay.
Eigen::Matrix3d with_heading_variance(Eigen::Matrix3d covariance, double variance) {
  const double factor = std::sqrt(variance / std::max(covariance(2, 2), kLeastVariance));
  covariance.row(2) *= factor;
  covariance.col(2) *= factor;
  return covariance + kLeastVariance * Eigen::Matrix3d::Identity();
}

bool has_moved(const geometry::SE2& from, const geometry::SE2& to) {
  return (to.translation() - from.translation()).norm() > kMoved_m ||
         std::abs(geometry::wrap_angle(to.theta() - from.theta())) > kRotated_rad;
}

}  // namespace

struct ChainLimit::Solution {
  std::vector<geometry::SE2> poses;
  std::vector<std::optional<Eigen::Vector2d>> landmarks_m;
};

ChainLimit::ChainLimit(const harness::ChainRun& run, const sim::World& world) {
  take_scans(run, world);
  if (scans_.size() < 2) throw std::runtime_error("limit: too few scans");
  take_motions(run);
  for (int round = 0; round < kNoiseRounds; ++round) scale_noise(solve(scans_.size()));
  const Solution solution = solve(scans_.size());
  for (std::size_t i = 0; i < scans_.size(); ++i)
    poses_.push_back({scans_[i].utime, solution.poses[i]});
}

void ChainLimit::take_scans(const harness::ChainRun& run, const sim::World& world) {
  const TrueLandmarks truth(world);
  landmarks_m_ = truth.places_m;
  for (const model::LandmarkScan& scan : run.scans) {
    const auto pose = metrics::pose_at(run.truth, scan.utime);
    if (!pose || (!scans_.empty() && !has_moved(scans_.back().truth, *pose))) continue;
    Scan taken;
    taken.utime = scan.utime;
    taken.truth = *pose;
    for (const model::Detection& detection : scan.detections) {
      const Eigen::Vector2d position_m = detection.position_m.head<2>();
      const auto landmark = truth.nearest(detection.kind, *pose * position_m);
      if (!landmark) continue;
      const std::size_t kind = detection.kind == model::LandmarkKind::kTrunk ? 0 : 1;
      taken.observations.push_back(
          {*landmark, kind, position_m, detection.covariance_m2.topLeftCorner<2, 2>()});
    }
    scans_.push_back(std::move(taken));
  }
}

/// What the input took out as the gyro's bias changes now and then: the motions are given with that
/// of the first one taken out, so that the bias of the graph is one random walk.
void ChainLimit::take_motions(const harness::ChainRun& run) {
  model::OdometryBuffer odometry;
  for (const model::Odometry& motion : run.motions) odometry.add(motion);
  std::optional<double> reference;
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    Scan& scan = scans_[i];
    const auto motion = odometry.between(scans_[i - 1].utime, scan.utime);
    if (!motion) throw std::runtime_error("limit: a gap in odometry");
    scan.motion = motion->mean;
    scan.covariance = motion->covariance + kLeastVariance * Eigen::Matrix3d::Identity();
    const auto gyro = odometry.gyro_rotation(scans_[i - 1].utime, scan.utime);
    if (!gyro || gyro->seconds <= 0.0) continue;
    const double taken_out = gyro->bias_rad / gyro->seconds;
    reference = reference.value_or(taken_out);
    scan.motion =
        factor_graph::plane::at_true_rate(motion->mean, *reference - taken_out, gyro->seconds);
    scan.covariance = with_heading_variance(motion->covariance, gyro->variance);
    scan.seconds = gyro->seconds;
  }
}

ChainLimit::Solution ChainLimit::solve(std::size_t scans) const {
  graph::FactorGraph all;
  std::vector<graph::VariableId> poses;
  std::vector<std::optional<graph::VariableId>> points(landmarks_m_.size());
  std::optional<graph::VariableId> bias;
  double bias_age_s = 0.0;
  for (std::size_t i = 0; i < scans; ++i) {
    const Scan& scan = scans_[i];
    poses.push_back(all.add(scan.truth));
    if (i == 0) {
      all.add(graph::prior(poses[0], scan.truth, kFixed * Eigen::Matrix3d::Identity()));
    } else if (scan.seconds > 0.0) {
      if (!bias) {
        bias = all.add(0.0);
        all.add(graph::prior(*bias, 0.0, 1.0 / (kBiasSigma_rad_s * kBiasSigma_rad_s)));
      } else if (bias_age_s > kBiasValidity_s) {
        const graph::VariableId next = all.add(0.0);
        all.add(graph::step(*bias, next, 1.0 / (kBiasWalk * kBiasWalk * bias_age_s)));
        bias = next;
        bias_age_s = 0.0;
      }
      bias_age_s += scan.seconds;
      all.add(graph::biased_relative(poses[i - 1], poses[i], *bias, scan.motion, scan.seconds,
                                     scan.covariance.inverse()));
    } else {
      all.add(graph::relative(poses[i - 1], poses[i], scan.motion, scan.covariance.inverse()));
    }

    for (const Observation& one : scan.observations) {
      auto& point = points[one.landmark];
      if (!point) point = all.add(landmarks_m_[one.landmark]);
      const double scale = noise_[one.kind] * noise_[one.kind];
      all.add(graph::observation(poses[i], *point, one.position_m,
                                 (scale * one.covariance_m2).inverse()));
    }
  }

  const factor_graph::batch::BatchReport report = factor_graph::batch::optimise(all);
  if (!report.ok) throw std::runtime_error("limit: " + report.error);
  Solution solution;
  for (const graph::VariableId pose : poses)
    solution.poses.push_back(graph::pose2_of(all.value(pose)));
  for (const auto& point : points) {
    solution.landmarks_m.emplace_back();
    if (point) solution.landmarks_m.back() = graph::point2_of(all.value(*point));
  }
  return solution;
}

/// A landmark takes two degrees of freedom; poses take few against all detections.
void ChainLimit::scale_noise(const Solution& solution) {
  double squared[2] = {0.0, 0.0};
  double freedom[2] = {0.0, 0.0};
  std::vector<bool> is_counted(landmarks_m_.size(), false);
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    for (const Observation& one : scans_[i].observations) {
      const Eigen::Vector2d residual =
          solution.poses[i].inverse() * *solution.landmarks_m[one.landmark] - one.position_m;
      squared[one.kind] += residual.dot(one.covariance_m2.inverse() * residual);
      freedom[one.kind] += is_counted[one.landmark] ? 2.0 : 0.0;
      is_counted[one.landmark] = true;
    }
  }
  for (std::size_t kind = 0; kind < 2; ++kind)
    if (freedom[kind] > 100.0) noise_[kind] = std::sqrt(squared[kind] / freedom[kind]);
}

metrics::StampedPose ChainLimit::causal(std::size_t scan) const {
  return {scans_[scan].utime, solve(scan + 1).poses.back()};
}

namespace {

std::optional<geometry::SE2> at_stamp(std::span<const metrics::StampedPose> poses,
                                      model::Utime utime) {
  const auto found = std::ranges::lower_bound(poses, utime, {}, &metrics::StampedPose::utime);
  if (found == poses.end() || found->utime != utime) return std::nullopt;
  return found->pose;
}

}  // namespace

LimitScore score_against_limit(const harness::ChainRun& run, const sim::World& world,
                               std::size_t times) {
  const ChainLimit limit(run, world);
  LimitScore score;
  score.trunk_noise = limit.trunk_noise();
  score.corner_noise = limit.corner_noise();

  std::vector<metrics::StampedPose> map;
  std::vector<metrics::StampedPose> batch;
  for (const metrics::StampedPose& keyframe : harness::poses_of(run.keyframes)) {
    const auto best = at_stamp(limit.poses(), keyframe.utime);
    if (!best) continue;
    map.push_back(keyframe);
    batch.push_back({keyframe.utime, *best});
  }
  score.keyframes = map.size();
  score.map_rms_m = harness::trajectory_error(map, run.truth).ate_rms_m;
  score.batch_rms_m = harness::trajectory_error(batch, run.truth).ate_rms_m;

  std::vector<metrics::StampedPose> said;
  std::vector<metrics::StampedPose> causal;
  const std::vector<metrics::StampedPose> slam = harness::poses_of(run.slam);
  for (std::size_t k = 1; k <= times; ++k) {
    const std::size_t scan = k * (limit.size() - 1) / times;
    const auto pose = at_stamp(slam, limit.utime(scan));
    if (!pose) continue;
    said.push_back({limit.utime(scan), *pose});
    causal.push_back(limit.causal(scan));
  }
  score.times = said.size();
  score.pose_rms_m = harness::trajectory_error(said, run.truth).ate_rms_m;
  score.causal_rms_m = harness::trajectory_error(causal, run.truth).ate_rms_m;
  return score;
}

}  // namespace understory::eval::experiments::frontend
