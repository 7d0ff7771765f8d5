#include "eval/harness/run.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "common/terminal/interrupt.hpp"

namespace understory::eval::harness {
namespace {

constexpr double kSnapshotFraction = 0.3;  // of the run: more than a quarter of the circle is done

/// Follows one method through one drive.
class Scorer {
 public:
  Scorer(const RecordedDrive& recorded, Stages stages)
      : recorded_(recorded), session_(std::move(stages)) {
    result_.score.updates_possible = static_cast<int>(recorded.scans.size() / kScansPerKeyframe);
  }

  void feed(std::size_t scan) {
    const auto outcome = session_.feed(recorded_.scans[scan].scan);
    if (outcome) base_of_keyframe_[outcome->keyframe.sequence] = base_scan(outcome->keyframe);
    if (!outcome && !session_.withheld_one()) return;
    score_state(scan + 1);
    if (outcome) {
      score_covariance(*outcome);
      take_snapshot(scan, *outcome);
    }
  }

  RunResult finish() {
    RunScore& score = result_.score;
    score.updates = static_cast<int>(result_.trace.final_map.poses.size());
    score.keyframes_withheld = score.updates_possible - score.updates;
    if (!truth_) return std::move(result_);
    score.ate_m = absolute_trajectory_error(result_.trace.final_map.poses, *truth_);
    score.completeness = map_completeness(result_.trace.final_map.landmarks_m, *truth_,
                                          recorded_.observation_count_of_trunk);
    score.landmarks_in_range = truth_->trunks_in_range().size();
    return std::move(result_);
  }

 private:
  static std::size_t base_scan(const model::Keyframe& keyframe) {
    return keyframe.members.front().sequence;
  }

  std::vector<metrics::PoseEstimate> poses() const {
    std::vector<metrics::PoseEstimate> result;
    for (const model::KeyframePose& pose : session_.mapper().trajectory()) {
      result.push_back({base_of_keyframe_.at(pose.keyframe_sequence), pose.map_T_vehicle});
    }
    return result;
  }

  void score_state(std::size_t scans) {
    metrics::MapState& state = result_.trace.final_map;
    state.poses = poses();
    landmarks_before_ = std::exchange(landmarks_, session_.mapper().landmarks());
    state.landmarks_m.clear();
    for (const model::MapLandmark& landmark : landmarks_)
      state.landmarks_m.push_back(landmark.position_m);

    if (state.poses.empty()) return;
    const std::size_t first_base = state.poses.front().scan;
    if (first_base_.value_or(first_base) != first_base) ++result_.score.new_maps;
    first_base_ = first_base;
    if (!truth_) truth_.emplace(recorded_.drive, first_base);

    for (const metrics::PoseEstimate& pose : state.poses) {
      if (accepted_.insert(pose.scan).second && error_m(pose) > kWrongPose_m) {
        ++result_.score.wrong_updates;
      }
    }

    const metrics::ErrorSums errors = errors_of(state, *truth_);
    result_.score.errors += errors;
    result_.trace.states.push_back(
        {scans, errors.rpe_m(), errors.lpe_m(), error_m(state.poses.back())});
    result_.marks.push_back(mark_of(state, scans));
  }

  double error_m(const metrics::PoseEstimate& pose) const {
    return (pose.map_T_vehicle.translation() - truth_->map_T_vehicle(pose.scan).translation())
        .norm();
  }

  StateMark mark_of(const metrics::MapState& state, std::size_t scans) const {
    StateMark mark;
    mark.scans = scans;
    for (const metrics::PoseEstimate& pose : state.poses) mark.bases.push_back(pose.scan);
    for (const Eigen::Vector2d& landmark : state.landmarks_m) {
      mark.trunks.push_back(truth_->nearest_trunk(landmark).index);
    }
    std::sort(mark.trunks.begin(), mark.trunks.end());
    mark.trunks.erase(std::unique(mark.trunks.begin(), mark.trunks.end()), mark.trunks.end());
    return mark;
  }

  void score_covariance(const KeyframeOutcome& outcome) {
    if (outcome.update.status != model::MapUpdateStatus::kUpdated || !truth_) return;
    const Eigen::LLT<Eigen::Matrix3d> factor(outcome.update.covariance);
    if (factor.info() != Eigen::Success) return;
    const std::size_t base = base_scan(outcome.keyframe);
    const Eigen::Vector3d error =
        (outcome.update.map_T_vehicle.inverse() * truth_->map_T_vehicle(base)).Log();
    result_.score.nees.emplace_back(base / kScansPerKeyframe, error.dot(factor.solve(error)));
  }

  void take_snapshot(std::size_t scan, const KeyframeOutcome& outcome) {
    const auto moment =
        static_cast<std::size_t>(kSnapshotFraction * static_cast<double>(recorded_.scans.size()));
    if (result_.trace.snapshot || scan < moment) return;
    if (outcome.update.status != model::MapUpdateStatus::kUpdated) return;
    std::vector<metrics::PoseEstimate> before = result_.trace.final_map.poses;
    if (!before.empty()) before.pop_back();
    result_.trace.snapshot = Snapshot{outcome.keyframe, outcome.update, std::move(before),
                                      landmarks_before_, landmarks_};
  }

  const RecordedDrive& recorded_;
  SlamSession session_;
  std::optional<metrics::MapTruth> truth_;
  std::optional<std::size_t> first_base_;  ///< Of the map in force.
  std::map<std::uint64_t, std::size_t> base_of_keyframe_;
  std::set<std::size_t> accepted_;  ///< Bases whose first estimate was judged.
  std::vector<model::MapLandmark> landmarks_;
  std::vector<model::MapLandmark> landmarks_before_;
  RunResult result_;
};

}  // namespace

RecordedDrive::RecordedDrive(const sim::DriveParameters& parameters, std::uint64_t seed)
    : drive(parameters, seed), observation_count_of_trunk(drive.forest().trunks_m.size(), 0) {
  scans.reserve(drive.size());
  for (std::size_t k = 0; k < drive.size(); ++k) {
    scans.push_back(drive.scan(k));
    for (const std::uint32_t trunk : scans.back().trunks) ++observation_count_of_trunk[trunk];
  }
}

RunResult run_slam(const RecordedDrive& recorded, Stages stages, const std::atomic<bool>& stop) {
  Scorer scorer(recorded, std::move(stages));
  for (std::size_t scan = 0; scan < recorded.scans.size(); ++scan) {
    if (stop) throw terminal::Interrupted{};
    scorer.feed(scan);
  }
  return scorer.finish();
}

}  // namespace understory::eval::harness
