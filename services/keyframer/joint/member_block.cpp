#include "services/keyframer/joint/member_block.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>

#include "common/geometry/decompositions.hpp"

namespace understory::keyframer::joint {
namespace {

/// chi^2 of a detection (2 degrees of freedom) beyond which it is no detection of the landmark: one
/// in 30,000.
constexpr double kOutlierChi2 = 20.7;
constexpr int kOutlierRounds = 2;
/// Largest eigenvalue that counts as zero, relative to the largest one.
constexpr double kRounding = 1e-9;

/// Most landmarks of a keyframe: bounds the cost of the estimate. No scene has so many.
constexpr std::size_t kMostLandmarks = 1000;

/// The members' tracks that may be landmarks, ascending: observed often enough and not doubtful.
/// Beyond the limit the most observed ones.
std::vector<TrackNumber> sure_tracks(std::span<const Member> members, const LocalMap& map,
                                     std::uint32_t min_observations) {
  const std::vector<TrackNumber> doubtful = map.doubtful();
  std::vector<TrackNumber> sure;
  for (const Member& member : members) {
    for (const TrackNumber id : map.resolved(member.placed.tracks)) {
      const Track* track = map.find(id);
      if (track == nullptr || track->observations < min_observations) continue;
      if (!std::ranges::binary_search(doubtful, id)) sure.push_back(id);
    }
  }
  std::ranges::sort(sure);
  sure.erase(std::unique(sure.begin(), sure.end()), sure.end());
  if (sure.size() <= kMostLandmarks) return sure;

  std::ranges::stable_sort(sure, std::greater(),
                           [&](TrackNumber id) { return map.find(id)->observations; });
  sure.resize(kMostLandmarks);
  std::ranges::sort(sure);
  return sure;
}

/// Collects the observations of the members, and gives each track a number as a landmark.
class BlockBuilder {
 public:
  BlockBuilder(std::span<const Member> members, const LocalMap& map, int min_observations)
      : map_(map), sure_(sure_tracks(members, map, static_cast<std::uint32_t>(min_observations))) {}

  void add(const Member& member, bool is_first) {
    const auto number = static_cast<std::uint32_t>(block_.problem.local_T_member.size());
    block_.problem.local_T_member.push_back(member.placed.local_T_vehicle);
    if (!is_first) block_.problem.motion.push_back(member.motion);

    const std::vector<TrackNumber> tracks = map_.resolved(member.placed.tracks);
    std::set<TrackNumber> used;  // A merged track may have two detections in one scan.
    for (std::size_t i = 0; i < member.scan.detections.size(); ++i) {
      if (!std::ranges::binary_search(sure_, tracks[i])) continue;
      const Track* track = map_.find(tracks[i]);
      if (!used.insert(track->id).second) continue;

      const model::Detection& detection = member.scan.detections[i];
      block_.problem.observations.push_back(
          {number, landmark_of(*track), detection.position_m.head<2>(),
           detection.covariance_m2.topLeftCorner<2, 2>(), static_cast<std::uint32_t>(i)});
    }
  }

  MemberBlock take() { return std::move(block_); }

 private:
  std::uint32_t landmark_of(const Track& track) {
    const auto next = static_cast<std::uint32_t>(block_.tracks.size());
    const auto [entry, fresh] = landmarks_.try_emplace(track.id, next);
    if (fresh) {
      block_.tracks.push_back(track.id);
      block_.problem.landmarks.push_back(track.position_m);
    }
    return entry->second;
  }

  const LocalMap& map_;
  std::vector<TrackNumber> sure_;  ///< Ascending.
  MemberBlock block_;
  std::map<TrackNumber, std::uint32_t> landmarks_;
};

/// Removes the observations that do not fit the estimate. Returns false if there are none.
bool remove_outliers(BlockProblem& problem, const BlockEstimate& estimate) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (estimate.chi2[i] <= kOutlierChi2) problem.observations[kept++] = problem.observations[i];
  }
  if (kept == problem.observations.size()) return false;
  problem.observations.resize(kept);
  return true;
}

std::vector<std::uint32_t> observation_counts(const BlockProblem& problem) {
  std::vector<std::uint32_t> count(problem.landmarks.size(), 0);
  for (const BlockObservation& z : problem.observations) ++count[z.landmark];
  return count;
}

template <int N>
bool is_covariance(const Eigen::Matrix<double, N, N>& matrix) {
  if (!matrix.allFinite() || matrix != matrix.transpose()) return false;
  const auto eigenvalues = geometry::eigenvalues(matrix);
  return eigenvalues.minCoeff() >= -kRounding * eigenvalues.maxCoeff();
}

/// Whether all covariances of the keyframe are valid.
bool are_covariances(const MemberBlock& block) {
  const BlockEstimate& estimate = block.estimate;
  const auto members = std::ranges::all_of(estimate.centre_T_member, [](const auto& member) {
    return is_covariance<3>(member.covariance);
  });
  const std::vector<std::uint32_t> count = observation_counts(block.problem);
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (count[i] > 0 && !is_covariance<2>(estimate.landmark_covariance[i])) return false;
  }
  return members;
}

/// Solves, and solves again without the observations that do not fit.
void adjust(MemberBlock& block) {
  block.estimate = adjust_block(block.problem);
  for (int round = 0; round < kOutlierRounds; ++round) {
    if (!remove_outliers(block.problem, block.estimate)) break;
    block.estimate = adjust_block(block.problem);
  }
}

/// Whether the IMU contradicts its covariances: the squared errors grow with it by far more than
/// the number of its measurements explains (six standard deviations of chi^2, and by half).
bool contradicts(const BlockEstimate& with_imu, const BlockEstimate& without) {
  const auto sum = [](const std::vector<double>& chi2) {
    return std::accumulate(chi2.begin(), chi2.end(), 0.0);
  };
  const double growth = with_imu.inertial_chi2 + sum(with_imu.chi2) - sum(without.chi2);
  const double expected = std::max(with_imu.inertial_degrees_of_freedom, 1);
  return !(growth <= 1.5 * expected + 6.0 * std::sqrt(2.0 * expected));
}

/// Solves with the IMU, unless it contradicts the observations.
void use_imu(std::span<const Member> members, const BiasEstimate& bias, MemberBlock& block) {
  BlockProblem problem = block.problem;
  problem.bias = bias;
  bool has_imu = false;
  for (std::size_t k = 1; k < members.size(); ++k) {
    std::optional<model::InertialMotion> inertial = members[k].inertial;
    if (inertial && !inertial_information(inertial->inertial.covariance)) inertial.reset();
    has_imu = has_imu || inertial.has_value();
    problem.inertial.push_back(std::move(inertial));
  }
  if (!has_imu || !block.estimate.converged) return;

  MemberBlock with_imu{problem, block.tracks, adjust_block(problem)};
  if (!with_imu.estimate.converged || !are_covariances(with_imu)) return;
  if (!contradicts(with_imu.estimate, block.estimate)) block = std::move(with_imu);
}

/// If odometry measured no motion, the tracked one is used.
void assume_motion(const BlockRules& rules, BlockProblem& problem) {
  const double m2 = rules.motion_sigma_m * rules.motion_sigma_m;
  const double rad2 = rules.motion_sigma_rad * rules.motion_sigma_rad;
  for (std::size_t k = 0; k < problem.motion.size(); ++k) {
    if (problem.motion[k]) continue;
    problem.motion[k] = geometry::SE2WithCovariance{
        problem.local_T_member[k].inverse() * problem.local_T_member[k + 1],
        Eigen::Vector3d(m2, m2, rad2).asDiagonal()};
  }
}

}  // namespace

MemberBlock adjust_members(std::span<const Member> members, const LocalMap& map,
                           const BlockRules& rules) {
  BlockBuilder builder(members, map, rules.min_observations);
  for (std::size_t k = 0; k < members.size(); ++k) builder.add(members[k], k == 0);
  MemberBlock block = builder.take();
  const std::vector<BlockObservation> observations = block.problem.observations;

  adjust(block);
  if (!block.estimate.determined && members.size() >= 2) {
    // Few landmarks connect the scans: undetermined directions get the uncertainty of a vehicle's
    // motion.
    block.problem.observations = observations;
    assume_motion(rules, block.problem);
    adjust(block);
  }
  use_imu(members, rules.bias, block);
  return block;
}

std::optional<std::string> why_unusable(std::span<const Member> members, const MemberBlock& block) {
  const bool has_motion =
      std::ranges::any_of(members, [](const Member& member) { return member.motion.has_value(); });
  if (!block.estimate.converged) return "joint estimate did not converge";
  if (!has_motion && block.tracks.size() < 3) return "fewer than three landmarks";
  if (!are_covariances(block)) return "the scans have too little in common";
  return std::nullopt;
}

model::Keyframe to_keyframe(std::span<const Member> members, const MemberBlock& block,
                            const LocalMap& map) {
  const BlockEstimate& estimate = block.estimate;
  model::Keyframe keyframe;
  keyframe.utime = members.front().scan.utime;
  keyframe.field_of_view = members.front().scan.field_of_view;

  for (std::size_t k = 0; k < members.size(); ++k) {
    keyframe.members.push_back({members[k].scan.utime, members[k].scan.sequence,
                                estimate.centre_T_member[k].mean,
                                estimate.centre_T_member[k].covariance});
  }

  const std::vector<std::uint32_t> count = observation_counts(block.problem);
  std::vector<std::uint32_t> number_of(block.tracks.size(), 0);  // In the keyframe.
  for (std::size_t i = 0; i < block.tracks.size(); ++i) {
    if (count[i] == 0) continue;
    const Track& track = *map.find(block.tracks[i]);
    number_of[i] = static_cast<std::uint32_t>(keyframe.landmarks.size());
    keyframe.landmarks.push_back({estimate.landmarks[i], estimate.landmark_covariance[i],
                                  track.radius_m, static_cast<std::uint16_t>(count[i]),
                                  track.kind});
  }
  for (const BlockObservation& z : block.problem.observations)
    keyframe.detections.push_back({z.member, z.detection, number_of[z.landmark]});
  return keyframe;
}

}  // namespace understory::keyframer::joint
