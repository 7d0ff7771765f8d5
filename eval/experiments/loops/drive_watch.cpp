#include "eval/experiments/loops/drive_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <span>

#include "eval/experiments/loops/loop_run.hpp"

namespace understory::eval::experiments::loops {
namespace {

/// 95 % quantile of chi^2 with 3 degrees of freedom.
constexpr double kChi2Of95Percent = 7.815;

double mean_of(std::span<const double> values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

int most_frequent(const std::map<int, int>& votes) {
  return std::ranges::max_element(votes, {}, [](const auto& one) { return one.second; })->first;
}

}  // namespace

DriveWatch::DriveWatch(const LoopDrive& drive) : drive_(drive) {
  for (std::size_t i = 0; i < drive.scans.size(); ++i) frame_at_[drive.scans[i].utime] = i;
}

void DriveWatch::follow(const model::MapUpdate& update) {
  using enum model::MapUpdateStatus;
  if (update.status == kRolledBack) ++fate_.rolled_back;
  if (update.status == kNotSure || update.status == kRejected) ++fate_.without_pose;
  for (const model::IdentifiedDetection& one : update.detections) {
    if (one.landmark_id == 0) continue;
    const std::size_t frame = update.scans[one.scan].sequence;
    ++votes_[one.landmark_id][drive_.trees[frame][one.detection]];
  }
  for (const auto& [old_id, new_id] : update.merged) merge(old_id, new_id);
}

void DriveWatch::follow(const model::MapDelta& delta) {
  for (const auto& [old_id, new_id] : delta.merged) merge(old_id, new_id);
}

void DriveWatch::follow(const model::SlamPose& pose) {
  const auto frame = frame_at_.find(pose.utime);
  if (frame == frame_at_.end() || !told_.insert(pose.utime).second) return;
  live_.push_back({frame->second, pose.map_id, pose.map_T_vehicle()});
}

void DriveWatch::follow(const model::LoopResult& result) {
  if (!result.reason.empty()) ++fate_.not_accepted[result.reason];
}

/// What was told twice finds nothing the second time.
void DriveWatch::merge(model::LandmarkId old_id, model::LandmarkId new_id) {
  const auto old = votes_.find(old_id);
  if (old == votes_.end() || old_id == new_id) return;
  const std::map<int, int> votes = std::move(old->second);
  votes_.erase(old);
  for (const auto& [tree, count] : votes) votes_[new_id][tree] += count;
}

DriveFate DriveWatch::sum_up(const model::WholeMap& map, const geometry::SE2& map_T_first) const {
  DriveFate fate = fate_;
  count_trees(map, fate);
  count_nees(map, map_T_first, fate);
  measure_live(fate);
  const std::size_t quarter = frames_ms_.size() / 4;
  fate.first_quarter_ms = mean_of(std::span(frames_ms_).first(quarter));
  fate.last_quarter_ms = mean_of(std::span(frames_ms_).last(quarter));
  return fate;
}

void DriveWatch::count_trees(const model::WholeMap& map, DriveFate& fate) const {
  std::map<int, int> landmarks;
  for (const model::MapLandmark& landmark : map.landmarks) {
    const auto votes = votes_.find(landmark.id);
    if (votes != votes_.end()) ++landmarks[most_frequent(votes->second)];
  }
  fate.trees = landmarks.size();
  fate.doubled = static_cast<std::size_t>(
      std::ranges::count_if(landmarks, [](const auto& one) { return one.second > 1; }));
}

/// Keyframes without a covariance are left out: the first one is the frame.
void DriveWatch::count_nees(const model::WholeMap& map, const geometry::SE2& map_T_first,
                            DriveFate& fate) const {
  std::vector<double> nees;
  for (const model::KeyframePose& keyframe : map.keyframes) {
    const auto frame = frame_at_.find(keyframe.utime);
    const bool is_stated =
        Eigen::LLT<Eigen::Matrix3d>(keyframe.covariance).info() == Eigen::Success;
    if (frame == frame_at_.end() || !is_stated) continue;
    const geometry::PosePair pair{keyframe.map_T_vehicle,
                                  map_T_first * drive_.truth[frame->second]};
    // The map is tied at its first keyframe, which is its frame.
    const Eigen::Matrix3d of_truth = geometry::covariance_of_truth(drive_.truth_sigma, pair.truth);
    if (const auto one = geometry::nees(pair, keyframe.covariance + of_truth)) nees.push_back(*one);
  }
  fate.nees = mean_of(nees);
  const auto within =
      std::ranges::count_if(nees, [](double one) { return one < kChi2Of95Percent; });
  if (!nees.empty())
    fate.within_95_pct = 100.0 * static_cast<double>(within) / static_cast<double>(nees.size());
}

void DriveWatch::measure_live(DriveFate& fate) const {
  std::vector<std::size_t> frames;
  std::vector<geometry::SE2> poses;
  for (const LivePose& one : live_) {
    if (one.map_id != live_.back().map_id) continue;
    frames.push_back(one.frame);
    poses.push_back(one.map_T_vehicle);
  }
  fate.live_poses = frames.size();
  if (!frames.empty()) fate.live_ate_m = path_errors(drive_, frames, poses).ate_m;
}

}  // namespace understory::eval::experiments::loops
