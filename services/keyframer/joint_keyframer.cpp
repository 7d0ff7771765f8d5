#include "services/keyframer/joint_keyframer.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

namespace understory::keyframer {
namespace {

/// chi^2 of a detection (2 degrees of freedom) beyond which it is not the landmark's: one in
/// 30,000.
constexpr double kOutlierChi2 = 20.7;

std::vector<std::uint32_t> observations(const BlockProblem& problem) {
  std::vector<std::uint32_t> count(problem.landmarks.size(), 0);
  for (const BlockObservation& z : problem.observations) ++count[z.landmark];
  return count;
}

/// Scans that few landmarks tie together leave motions open; what the solver then gives for their
/// covariance is rounding, and may be anything.
bool are_covariances(const BlockEstimate& estimate) {
  return std::ranges::all_of(
      estimate.centre_T_member, [](const geometry::SE2WithCovariance& member) {
        const Eigen::Matrix3d symmetric = 0.5 * (member.covariance + member.covariance.transpose());
        if (!symmetric.allFinite()) return false;
        const Eigen::Vector3d eigenvalues =
            Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(symmetric, Eigen::EigenvaluesOnly)
                .eigenvalues();
        return eigenvalues.minCoeff() >= -1e-9 * eigenvalues.maxCoeff();
      });
}

}  // namespace

JointKeyframer::JointKeyframer(const JointKeyframerParameters& parameters)
    : parameters_(parameters), tracker_(parameters) {}

void JointKeyframer::add(const model::Odometry& odometry) { odometry_.add(odometry); }

std::optional<model::Keyframe> JointKeyframer::add(const model::LandmarkScan& raw) {
  const model::LandmarkScan scan = level_.levelled(raw);
  ++counters_.scans;
  if (last_utime_ && scan.utime <= *last_utime_) {
    counters_.last_reason = "scan not later than the last one";
    ++counters_.scans_unmatched;
    return std::nullopt;
  }
  std::optional<geometry::SE2WithCovariance> motion;
  if (last_utime_) motion = odometry_.between(*last_utime_, scan.utime);
  FollowedScan tracked = tracker_.add(scan, motion);
  if (!tracked.tracked) return lost(scan);
  last_utime_ = scan.utime;
  odometry_.forget_before(scan.utime);
  members_.push_back({scan, std::move(tracked), motion});
  if (members_.size() < static_cast<std::size_t>(parameters_.observations_per_keyframe)) {
    return std::nullopt;
  }
  return finish();
}

/// The chain is broken: what was gathered is published, and tracking starts anew at this scan.
std::optional<model::Keyframe> JointKeyframer::lost(const model::LandmarkScan& scan) {
  ++counters_.scans_unmatched;
  counters_.last_reason = "scan matches the landmarks before it too badly";
  std::optional<model::Keyframe> result;
  if (members_.size() >= 2) {
    result = finish();
  } else if (!members_.empty()) {
    ++counters_.keyframes_withheld;
    members_.clear();
  }
  local_T_previous_base_.reset();
  last_utime_ = scan.utime;
  odometry_.forget_before(scan.utime);
  members_.push_back({scan, tracker_.restart(scan), std::nullopt});
  return result;
}

/// `tracks` receives the track of each landmark of the problem.
BlockProblem JointKeyframer::problem(std::vector<std::uint32_t>& tracks) const {
  BlockProblem problem;
  std::map<std::uint32_t, std::uint32_t> index;
  for (std::uint32_t k = 0; k < members_.size(); ++k) {
    const Member& member = members_[k];
    problem.local_T_member.push_back(member.tracked.local_T_vehicle);
    if (k > 0) problem.motion.push_back(member.motion);
    std::vector<std::uint32_t> used;  // A merged track may have two detections in one scan.
    for (std::size_t i = 0; i < member.scan.detections.size(); ++i) {
      const std::uint32_t id = tracker_.resolved(member.tracked.tracks[i]);
      const Track* track = tracker_.find(id);
      if (track == nullptr ||
          track->observations < static_cast<std::uint32_t>(parameters_.min_observations) ||
          tracker_.doubtful(*track)) {
        continue;
      }
      if (std::find(used.begin(), used.end(), id) != used.end()) continue;
      used.push_back(id);
      const auto [entry, fresh] = index.try_emplace(id, static_cast<std::uint32_t>(tracks.size()));
      if (fresh) {
        tracks.push_back(id);
        problem.landmarks.push_back(track->position_m);
      }
      const model::Detection& detection = member.scan.detections[i];
      problem.observations.push_back({k, entry->second, detection.position_m.head<2>(),
                                      detection.covariance_m2.topLeftCorner<2, 2>()});
    }
  }
  return problem;
}

std::optional<model::Keyframe> JointKeyframer::finish() {
  std::vector<std::uint32_t> tracks;
  BlockProblem block = problem(tracks);
  const geometry::SE2 local_T_base = block.local_T_member.front();
  BlockEstimate estimate = adjust_block(block);
  for (int round = 0; round < 2; ++round) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < block.observations.size(); ++i) {
      if (estimate.chi2[i] <= kOutlierChi2) block.observations[kept++] = block.observations[i];
    }
    if (kept == block.observations.size()) break;
    block.observations.resize(kept);
    estimate = adjust_block(block);
  }
  const bool has_motion = std::any_of(members_.begin(), members_.end(),
                                      [](const Member& m) { return m.motion.has_value(); });
  std::string reason;
  if (!estimate.converged) {
    reason = "joint estimate did not converge";
  } else if (!has_motion && tracks.size() < 3) {
    reason = "fewer than three landmarks";
  } else if (!are_covariances(estimate)) {
    reason = "the scans have too little in common";
  }
  if (!reason.empty()) {
    ++counters_.keyframes_withheld;
    counters_.last_reason = reason;
    members_.clear();
    return std::nullopt;
  }
  model::Keyframe result = keyframe(block, estimate, tracks);
  if (local_T_previous_base_)
    result.previous_T_base = local_T_previous_base_->inverse() * local_T_base;
  local_T_previous_base_ = local_T_base;
  members_.clear();
  ++counters_.keyframes;
  return result;
}

model::Keyframe JointKeyframer::keyframe(const BlockProblem& block, const BlockEstimate& estimate,
                                         const std::vector<std::uint32_t>& tracks) {
  model::Keyframe result;
  result.utime = members_.front().scan.utime;
  result.sequence = next_sequence_++;
  result.field_of_view = members_.front().scan.field_of_view;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    result.members.push_back({members_[k].scan.utime, members_[k].scan.sequence,
                              estimate.centre_T_member[k].mean,
                              estimate.centre_T_member[k].covariance});
  }
  const std::vector<std::uint32_t> seen = observations(block);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (seen[i] == 0) continue;
    const Track* track = tracker_.find(tracks[i]);
    result.landmarks.push_back({estimate.landmarks[i], estimate.landmark_covariance[i],
                                track->radius_m, static_cast<std::uint16_t>(seen[i]), track->kind});
  }
  return result;
}

}  // namespace understory::keyframer
