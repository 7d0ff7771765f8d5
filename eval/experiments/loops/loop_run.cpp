#include "eval/experiments/loops/loop_run.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "common/bus/config_file.hpp"
#include "common/bus/launch_config.hpp"
#include "common/geometry/alignment.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/harness/sensor_chain.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/loop_closer/adapter_parameters.hpp"
#include "services/loop_closer/loop_closer.hpp"

namespace understory::eval::experiments::loops {
namespace {

/// A closure is wrong where it is off by more than this and by more than five sigmas [m].
constexpr double kWrongM = 0.5;
constexpr double kWrongSigmas = 5.0;
/// A query has a true match where an earlier frame is within the first distance, and none where no
/// one is within the second [m]; earlier: by so much path.
constexpr double kMatchM = 5.0;
constexpr double kNoMatchM = 20.0;
constexpr double kEarlierM = 100.0;

loop_closer::LoopCloserParameters closer_parameters(const std::filesystem::path& config_dir) {
  loop_closer::LoopCloserParameters parameters;
  bus::ParameterTable table;
  loop_closer::describe(parameters, table);
  const std::filesystem::path file = bus::config_file_in(config_dir, "loop_closer");
  if (!file.empty()) table.load_text(bus::read_config_file(file), file.string());
  return parameters;
}

/// What the loop closer asks and says, against the truth.
class ClosureScore {
 public:
  explicit ClosureScore(const LoopDrive& drive) : drive_(drive) {
    double along_m = 0.0;
    for (std::size_t i = 0; i < drive.truth.size(); ++i) {
      if (i > 0)
        along_m += (drive.truth[i].translation() - drive.truth[i - 1].translation()).norm();
      along_m_.push_back(along_m);
    }
  }

  void count_query(std::size_t frame, double ms, LoopScore& score) {
    double nearest_m = 1e9;
    for (std::size_t i = 0; i < frame && along_m_[i] <= along_m_[frame] - kEarlierM; ++i)
      nearest_m = std::min(
          nearest_m, (drive_.truth[i].translation() - drive_.truth[frame].translation()).norm());
    ++score.queries;
    if (nearest_m > kNoMatchM) ++score.without_match;
    if (nearest_m < kMatchM) ++score.with_match;
    search_ms_.push_back(ms);
  }

  /// `from`, `to`: frames of its ends.
  void judge(const model::LoopClosure& closure, std::size_t from, std::size_t to,
             LoopScore& score) {
    const geometry::SE2 truth = drive_.truth[from].inverse() * drive_.truth[to];
    const Eigen::Vector3d off = (closure.from_T_to.mean.inverse() * truth).Log();
    const double squared = off.dot(closure.from_T_to.covariance.llt().solve(off));
    const double off_m = off.head<2>().norm();
    const bool is_wrong = off_m > kWrongM && squared > kWrongSigmas * kWrongSigmas;
    is_wrong_[closure.id] = is_wrong;
    ++score.sent;
    if (is_wrong) ++score.sent_wrong;
    score.mean_nees += squared;
  }

  void accept(std::uint64_t id) { accepted_.insert(id); }

  void sum_up(const loop_closer::LoopCloser& closer, LoopScore& score) const {
    if (score.sent > 0) score.mean_nees /= static_cast<double>(score.sent);
    score.accepted = accepted_.size();
    for (const std::uint64_t id : accepted_) score.accepted_wrong += is_wrong_.at(id);
    score.search_ms_p50 = tools::quantile(search_ms_, 0.5);
    score.search_ms_p99 = tools::quantile(search_ms_, 0.99);
    score.unexpected = closer.counters().unexpected;
  }

 private:
  const LoopDrive& drive_;
  std::vector<double> along_m_;
  std::map<std::uint64_t, bool> is_wrong_;  ///< Of those that were sent.
  std::set<std::uint64_t> accepted_;
  std::vector<double> search_ms_;
};

/// Asks the loop closer, and notes what it does.
std::optional<model::LoopClosure> ask(const model::MapUpdate& update, std::size_t frame,
                                      loop_closer::LoopCloser& closer, ClosureScore& closures,
                                      LoopScore& score) {
  const std::uint64_t before = closer.counters().queries;
  const double start_s = tools::thread_time_s();
  auto closure = closer.add(update);
  if (closer.counters().queries > before)
    closures.count_query(frame, 1e3 * (tools::thread_time_s() - start_s), score);
  return closure;
}

/// One drive through the stages.
class LoopRun {
 public:
  LoopRun(const LoopDrive& drive, const std::filesystem::path& config_dir, bool with_loop_closer)
      : drive_(drive),
        chain_({keyframer::keyframer_service(), geoslam_mapper::geoslam_mapper_service()},
               config_dir),
        scores_(drive),
        fate_(drive) {
    if (with_loop_closer) closer_.emplace(closer_parameters(config_dir));
    for (std::size_t i = 0; i < drive.scans.size(); ++i) frame_at_[drive.scans[i].utime] = i;
    watch();
  }

  LoopScore run() {
    for (std::size_t i = 0; i < drive_.scans.size(); ++i) {
      terminal::throw_if_interrupted();
      const double before_s = spent_s();
      if (i > 0) chain_.feed("ODOMETRY", wire::encode_message(drive_.odometry[i - 1]));
      chain_.feed("LANDMARKS", wire::encode_message(drive_.scans[i]));
      send_closures();
      fate_.frame_took(1e3 * (spent_s() - before_s));
    }
    chain_.finish();
    sum_up();
    return score_;
  }

 private:
  void watch() {
    chain_.watch<model::Keyframe>("KEYFRAME", [this](const model::Keyframe& keyframe) {
      ++score_.keyframes;
      frame_of_[keyframe.sequence] = frame_at_.at(keyframe.utime);
      if (!closer_) return;
      const double start_s = tools::thread_time_s();
      closer_->add(keyframe);
      closer_s_ += tools::thread_time_s() - start_s;
    });
    chain_.watch<model::MapUpdate>("SLAM_UPDATE",
                                   [this](const model::MapUpdate& update) { follow(update); });
    chain_.watch<model::MapDelta>("MAP_DELTA",
                                  [this](const model::MapDelta& delta) { fate_.follow(delta); });
    chain_.watch<model::SlamPose>("SLAM_POSE",
                                  [this](const model::SlamPose& pose) { fate_.follow(pose); });
    chain_.watch<model::LoopResult>("LOOP_RESULT",
                                    [this](const model::LoopResult& result) { follow(result); });
    chain_.watch<model::WholeMap>("MAP", [this](const model::WholeMap& map) { last_map_ = map; });
  }

  /// Processor time of all stages so far.
  double spent_s() const {
    double sum_s = closer_s_;
    for (const std::string& service : chain_.services()) sum_s += chain_.time_of(service).total_s;
    return sum_s;
  }

  void follow(const model::MapUpdate& update) {
    using enum model::MapUpdateStatus;
    fate_.follow(update);
    const std::size_t frame = frame_of_.at(update.keyframe_sequence);
    if (update.status == kFirstMap) {
      ++score_.maps;
      score_.first_frame = frame;
      map_T_first_ = update.map_T_vehicle * drive_.truth[frame].inverse();
    }
    if (update.status == kFirstMap || update.status == kUpdated) ++score_.placed;
    if (!closer_) return;
    const double start_s = tools::thread_time_s();
    if (auto closure = ask(update, frame, *closer_, scores_, score_))
      closures_.push_back(std::move(*closure));
    closer_s_ += tools::thread_time_s() - start_s;
  }

  void follow(const model::LoopResult& result) {
    if (closer_) closer_->add(result);
    fate_.follow(result);
    using enum model::LoopResult::Status;
    if (result.status == kRefused) ++score_.refused;
    if (result.status == kWaiting) ++score_.waiting;
    if (result.status == kAccepted) scores_.accept(result.closure_id);
  }

  /// What was found leaves after the scan that showed it, as on a bus.
  void send_closures() {
    for (const model::LoopClosure& closure : closures_) {
      scores_.judge(closure, frame_of_.at(closure.from.keyframe), frame_of_.at(closure.to.keyframe),
                    score_);
      const double before_s = chain_.time_of("geoslam_mapper").total_s;
      chain_.feed("LOOP_CLOSURE", wire::encode_message(closure));
      const double took_ms = 1e3 * (chain_.time_of("geoslam_mapper").total_s - before_s);
      score_.largest_closure_ms = std::max(score_.largest_closure_ms, took_ms);
    }
    closures_.clear();
  }

  void sum_up() {
    if (closer_) scores_.sum_up(*closer_, score_);
    std::vector<double> calls;
    for (const float ms : chain_.time_of("geoslam_mapper").calls_ms) calls.push_back(ms);
    score_.mapper_ms_p99 = tools::quantile(calls, 0.99);
    if (!last_map_ || last_map_->keyframes.empty()) return;

    std::vector<std::size_t> frames;
    std::vector<geometry::SE2> poses;
    for (const model::KeyframePose& keyframe : last_map_->keyframes) {
      frames.push_back(frame_of_.at(keyframe.keyframe_sequence));
      poses.push_back(map_T_first_.inverse() * keyframe.map_T_vehicle);
    }
    score_.in_map = frames.size();
    const PathErrors errors = path_errors(drive_, frames, poses);
    score_.error_m = errors.mean_m;
    score_.ate_m = errors.ate_m;
    score_.fate = fate_.sum_up(*last_map_, map_T_first_);
  }

  const LoopDrive& drive_;
  harness::SensorChain chain_;
  ClosureScore scores_;
  DriveWatch fate_;
  double closer_s_ = 0.0;  ///< Processor time of the loop closer, which is not in the chain.
  std::optional<loop_closer::LoopCloser> closer_;
  std::map<model::Utime, std::size_t> frame_at_;
  std::map<std::uint64_t, std::size_t> frame_of_;  ///< By sequence of the keyframe.
  std::vector<model::LoopClosure> closures_;       ///< Not sent yet.
  std::optional<model::WholeMap> last_map_;
  geometry::SE2 map_T_first_;
  LoopScore score_;
};

/// A scan as a keyframe of its own.
model::Keyframe keyframe_of(const model::LandmarkScan& scan, std::uint64_t sequence) {
  model::Keyframe keyframe;
  keyframe.utime = scan.utime;
  keyframe.sequence = sequence;
  keyframe.field_of_view = scan.field_of_view;
  keyframe.members.push_back({scan.utime, scan.sequence, {}, Eigen::Matrix3d::Zero()});
  for (const model::Detection& detection : scan.detections) {
    model::KeyframeLandmark landmark;
    landmark.position_m = detection.position_m.head<2>();
    landmark.covariance_m2 = detection.covariance_m2.topLeftCorner<2, 2>();
    landmark.radius_m = detection.radius_m;
    landmark.kind = detection.kind;
    keyframe.landmarks.push_back(landmark);
  }
  return keyframe;
}

}  // namespace

PathErrors path_errors(const LoopDrive& drive, const std::vector<std::size_t>& frames,
                       const std::vector<geometry::SE2>& poses) {
  std::vector<Eigen::Vector2d> truth_m;
  std::vector<Eigen::Vector2d> path_m;
  PathErrors errors;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    truth_m.emplace_back(drive.truth[frames[i]].translation());
    path_m.emplace_back(poses[i].translation());
    errors.mean_m += (truth_m.back() - path_m.back()).norm();
  }
  errors.mean_m /= static_cast<double>(frames.size());

  const geometry::SE2 truth_T_path = geometry::align_rigid(truth_m, path_m);
  double squared = 0.0;
  for (std::size_t i = 0; i < path_m.size(); ++i)
    squared += (truth_T_path * path_m[i] - truth_m[i]).squaredNorm();
  errors.ate_m = std::sqrt(squared / static_cast<double>(frames.size()));
  return errors;
}

LoopScore reckon_drive(const LoopDrive& drive, const std::filesystem::path& config_dir) {
  loop_closer::LoopCloser closer(closer_parameters(config_dir));
  ClosureScore closures(drive);
  LoopScore score;
  score.maps = 1;
  geometry::SE2WithCovariance pose;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    terminal::throw_if_interrupted();
    if (i > 0)
      pose = compound(pose, {drive.odometry[i - 1].from_T_to, drive.odometry[i - 1].covariance});
    closer.add(keyframe_of(drive.scans[i], i));
    ++score.keyframes;
    model::MapUpdate update;
    update.keyframe_sequence = i;
    update.utime = drive.scans[i].utime;
    update.status = model::MapUpdateStatus::kUpdated;
    update.map_T_vehicle = pose.mean;
    update.covariance = pose.covariance;
    if (const auto closure = ask(update, i, closer, closures, score))
      closures.judge(*closure, closure->from.keyframe, i, score);
  }
  closures.sum_up(closer, score);
  return score;
}

LoopScore run_drive(const LoopDrive& drive, const std::filesystem::path& config_dir,
                    bool with_loop_closer) {
  return LoopRun(drive, config_dir, with_loop_closer).run();
}

}  // namespace understory::eval::experiments::loops
