#include "eval/experiments/existence/camera/camera_run.hpp"

#include <cmath>

#include "eval/experiments/existence/camera/tracker.hpp"
#include "eval/harness/camera_relocalisation.hpp"
#include "sim/hash_random.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

/// Fewer looks in a drive say nothing about a point that was not seen.
constexpr int kLooksThatCount = 3;

std::vector<double> probabilities(const Method& method, std::size_t count) {
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(method.probability(i));
  return all;
}

std::vector<CameraPoint> culled(const std::vector<CameraPoint>& map,
                                const std::vector<double>& probability) {
  std::vector<CameraPoint> left;
  for (std::size_t i = 0; i < map.size(); ++i)
    if (probability[i] >= kRemovedBelow) left.push_back(map[i]);
  return left;
}

std::vector<Query> relocalise_all(const CameraCase& of, const CaseSetting& setting,
                                  const std::vector<CameraPoint>& map, std::uint64_t seed) {
  std::vector<harness::MappedKeypoint> known;
  known.reserve(map.size());
  for (const CameraPoint& point : map) known.push_back({point.position_m, point.descriptor});
  std::vector<Query> queries;
  const auto step = static_cast<std::size_t>(setting.frames_per_query);
  for (std::size_t k = 0; k < of.held_out.size(); k += step) {
    const harness::Relocalisation found =
        harness::relocalise(of.held_out[k], of.camera, known, {}, sim::mixed(seed, k));
    queries.push_back({found.is_success, found.is_accepted && !found.is_success,
                       found.pose.iterations, found.position_error_m});
  }
  return queries;
}

void track_all(const CameraCase& of, const std::vector<CameraPoint>& map, std::uint64_t seed,
               MethodOnCase& result) {
  CameraTracker tracker(of.camera, seed);
  double sum_m2 = 0.0;
  for (const sim::changes::CameraFrame& frame : of.held_out) {
    const Eigen::Isometry3d pose = tracker.track(frame, map);
    sum_m2 += (pose.translation() - frame.world_T_camera.translation()).squaredNorm();
  }
  result.ate_m = std::sqrt(sum_m2 / static_cast<double>(of.held_out.size()));
  result.lost = tracker.lost();
}

/// Points that are nothing (false keypoints alone) are not scored.
void score(const CameraCase& of, const std::vector<double>& probability, MethodOnCase& result) {
  const std::vector<PointTruth>& truth = of.history.drives.back().truth;
  for (std::size_t i = 0; i < of.map.size(); ++i) {
    if (of.map[i].truth == sim::changes::kNoPoint) continue;
    auto& points = truth[i].is_scored ? result.scored : result.rest;
    points.push_back({probability[i], truth[i].exists});
    if (truth[i].is_hidden) result.hidden.push_back(points.back());
  }
}

/// Looks of a drive, by point.
struct LooksOfPoint {
  int all = 0;
  int seen = 0;
};

MappingSignal signal_of(const DriveLooks& drive, const DriveKeypoints& keypoints,
                        const std::vector<double>& before, const std::vector<double>& after) {
  std::vector<LooksOfPoint> looks(before.size());
  for (const LookEvent& event : drive.looks) {
    ++looks[event.point].all;
    looks[event.point].seen += event.is_seen ? 1 : 0;
  }
  double expected = 0.0;
  MappingSignal signal;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (before[i] < kRemovedBelow || looks[i].all < kLooksThatCount) continue;
    expected += 1.0;
    signal.missed_points += looks[i].seen == 0 ? 1.0 : 0.0;
    signal.doubt += 1.0 - after[i];
  }
  if (expected > 0.0) {
    signal.missed_points /= expected;
    signal.doubt /= expected;
  }
  if (keypoints.all > 0)
    signal.keypoints_without =
        static_cast<double>(keypoints.without_point) / static_cast<double>(keypoints.all);
  return signal;
}

/// P of all points after the last drive; the signals on the way where they are wanted.
std::vector<double> update(const TunedMethod& tuned, const CameraCase& of, const History& history,
                           std::vector<MappingSignal>* signals) {
  const auto method = tuned.make(history, tuned.tuned);
  std::vector<double> now;
  for (std::size_t k = 0; k < history.drives.size(); ++k) {
    const std::vector<double> before = std::move(now);
    feed(*method, history, k, k);
    now = probabilities(*method, of.map.size());
    if (signals == nullptr || k < history.mapping_drives) continue;
    signals->push_back(signal_of(history.drives[k], of.keypoints[k], before, now));
  }
  return now;
}

}  // namespace

CaseResult run_case(const CaseSetting& setting, std::uint64_t seed,
                    const std::vector<CameraMethod>& methods, std::size_t signal_method) {
  const CameraCase of = make_case(setting, seed);
  const History blind = without_rays(of.history);
  CaseResult result;
  result.setting = setting;
  result.seed = seed;
  result.map_points = of.map.size();
  result.tracked_frames = of.held_out.size();
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const std::vector<double> probability =
        update(methods[m].tuned, of, methods[m].has_rays ? of.history : blind,
               m == signal_method ? &result.signals : nullptr);
    const std::vector<CameraPoint> map = culled(of.map, probability);
    MethodOnCase& made = result.methods.emplace_back();
    made.map_points = map.size();
    score(of, probability, made);
    if (methods[m].is_ablation) continue;
    made.queries = relocalise_all(of, setting, map, seed);
    track_all(of, map, sim::mixed(seed, 7), made);
  }
  return result;
}

}  // namespace understory::eval::experiments::existence::camera
