#include "eval/experiments/reliability/pose_judge.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::reliability {
namespace {

constexpr double kSettles_s = 0.2;
constexpr double kGoesOn_s = 2.0;
constexpr double kFar_m = 1.0;
/// Chi-squared of three degrees of freedom with the probability of 3 sigma.
constexpr double kThreeSigma = 14.16;
/// A micrometre, a microradian: a map's first poses may be exact.
constexpr double kExact = 1e-12;

/// A pose beside the truth in its own frame.
struct JudgedPose {
  Eigen::Vector2d error_m = Eigen::Vector2d::Zero();  ///< Frame `world`.
  double nees = 0.0;
};

/// Ties each frame to the truth by the first pose in it.
class FrameTies {
 public:
  JudgedPose judge(const SaidPose& pose, const geometry::SE2& world_T_vehicle) {
    const geometry::SE2 frame_T_world =
        ties_.try_emplace(pose.frame, pose.frame_T_vehicle * world_T_vehicle.inverse())
            .first->second;
    const geometry::SE2 vehicle_T_truth =
        pose.frame_T_vehicle.inverse() * (frame_T_world * world_T_vehicle);
    const Eigen::Vector3d off = vehicle_T_truth.coordinates();
    const Eigen::Matrix3d covariance = pose.covariance + kExact * Eigen::Matrix3d::Identity();
    const Eigen::Vector2d error_m = (frame_T_world.inverse() * pose.frame_T_vehicle).translation() -
                                    world_T_vehicle.translation();
    return {error_m, off.dot(covariance.llt().solve(off))};
  }

 private:
  std::map<std::uint32_t, geometry::SE2> ties_;
};

/// Longest stretch of poses for which something holds [s].
class Stretch {
 public:
  void add(double at_s, bool holds) {
    if (!holds) since_s_.reset();
    if (holds && !since_s_) since_s_ = at_s;
    if (since_s_) longest_s_ = std::max(longest_s_, at_s - *since_s_);
  }
  double longest_s() const { return longest_s_; }

 private:
  std::optional<double> since_s_;
  double longest_s_ = 0.0;
};

double next_from_s(std::span<const Fault> faults, std::size_t begun) {
  return begun < faults.size() ? faults[begun].from_s : 1e18;
}

}  // namespace

std::optional<SaidPose> said_pose(const model::SlamPose& pose) {
  if (pose.status && !pose.is_localised()) return std::nullopt;
  return SaidPose{pose.utime,           1e-6 * static_cast<double>(pose.utime),
                  pose.map_T_vehicle(), pose.covariance,
                  pose.map_id,          pose.reset_counter};
}

SaidPose said_pose(const model::EkfPose& pose) {
  return {pose.utime,
          1e-6 * static_cast<double>(pose.utime),
          pose.ekf_map_T_vehicle,
          pose.covariance,
          0,
          pose.reset_counter};
}

Broken broken(std::span<const SaidPose> poses) {
  Broken result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SaidPose& pose = poses[i];
    const bool is_finite = pose.covariance.allFinite() &&
                           pose.frame_T_vehicle.translation().allFinite() &&
                           std::isfinite(pose.frame_T_vehicle.theta());
    if (!is_finite) ++result.not_finite;
    const Eigen::Matrix3d floored = pose.covariance + kExact * Eigen::Matrix3d::Identity();
    if (is_finite && floored.llt().info() != Eigen::Success) ++result.not_positive_definite;
    if (i > 0 && pose.utime <= poses[i - 1].utime) ++result.not_later;
  }
  return result;
}

std::vector<AfterFault> judge(std::span<const SaidPose> poses,
                              std::span<const metrics::StampedPose> truth,
                              std::span<const Fault> faults) {
  std::vector<AfterFault> scores(faults.size());
  std::vector<Stretch> ok_while_far(faults.size());
  FrameTies ties;
  SaidPose before;  // the last one before the latest fault
  Eigen::Vector2d error_before_m = Eigen::Vector2d::Zero();
  std::size_t begun = 0;
  for (const SaidPose& pose : poses) {
    const auto is = metrics::pose_at(truth, pose.utime);
    if (!is) continue;
    const JudgedPose judged = ties.judge(pose, *is);

    // Which fault is behind it?
    const double at_s = 1e-6 * static_cast<double>(pose.utime);
    while (begun < faults.size() && at_s >= faults[begun].from_s) ++begun;
    const bool is_before = begun == 0 || at_s + kSettles_s >= next_from_s(faults, begun);
    if (is_before) {
      before = pose;
      error_before_m = judged.error_m;
    }
    if (begun == 0 || at_s < faults[begun - 1].to_s + kSettles_s) continue;

    AfterFault& score = scores[begun - 1];
    ++score.poses;
    if (judged.nees <= kThreeSigma) ++score.within_3_sigma;
    const double step_m = is_before ? 0.0 : (judged.error_m - error_before_m).norm();
    score.largest_step_m = std::max(score.largest_step_m, step_m);
    score.largest_sigmas = std::max(score.largest_sigmas, std::sqrt(judged.nees));
    if (at_s > faults[begun - 1].to_s + kGoesOn_s) score.goes_on = true;
    if (pose.frame != before.frame || pose.resets != before.resets) score.is_announced = true;
    if (pose.is_ok && !score.is_announced)
      score.largest_unannounced_m = std::max(score.largest_unannounced_m, step_m);
    Stretch& far = ok_while_far[begun - 1];
    far.add(at_s, pose.is_ok && judged.error_m.norm() > kFar_m);
    score.ok_while_far_s = far.longest_s();
  }
  return scores;
}

bool HealthState::is_ok() const {
  return std::ranges::all_of(
      states_, [](const auto& entry) { return entry.second.state == health_t::STATE_OK; });
}

std::string HealthState::text() const {
  std::string result;
  for (const auto& [process, health] : states_) {
    if (health.state == health_t::STATE_OK) continue;
    result += (result.empty() ? "" : "; ") + process + ":";
    for (const reason_count_t& reason : health.reasons)
      result += fmt::format(" {} {}", reason.reason, reason.count);
  }
  return result;
}

std::int64_t HealthState::pid(const std::string& process) const {
  const auto found = states_.find(process);
  return found == states_.end() ? 0 : found->second.pid;
}

std::uint64_t HealthState::lost() const {
  std::uint64_t sum = 0;
  for (const auto& [process, health] : states_) {
    for (const channel_health_t& channel : health.channels)
      sum += static_cast<std::uint64_t>(channel.lost + channel.dropped);
  }
  return sum;
}

}  // namespace understory::eval::experiments::reliability
