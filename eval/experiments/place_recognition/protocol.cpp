#include "eval/experiments/place_recognition/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/place_recognition/place_confidence.hpp"
#include "eval/tools/parallel.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::place_recognition {
namespace {

namespace places = understory::place_recognition;

/// Of a window: stems that too few of its frames saw are false ones, as a rule.
constexpr double kLeastSeenWeight = 0.6;

Trial judged(const places::PlaceAnswer& answer, const StemDrive& queries, std::size_t query,
             const StemDrive& map, const Protocol& protocol) {
  Trial trial;
  const places::PlaceCandidate* best = answer.best();
  if (best == nullptr) return trial;
  const auto frame = static_cast<std::size_t>(best->frame);
  const geometry::SE2 truth = map.world_T_level[frame].inverse() * queries.world_T_level[query];
  trial.has_answer = true;
  trial.is_right = truth.translation().norm() <= protocol.radius_m;
  trial.confidence = confidence_of(answer, protocol.radius_m);
  trial.is_accepted = trial.confidence >= kAcceptDecades;
  if (!trial.is_right) return trial;

  trial.error_m = (best->frame_T_query.translation() - truth.translation()).norm();
  for (const places::StemPair& pair : best->pairs) trial.residual_m.push_back(pair.distance_m);
  return trial;
}

/// Frames of the map that may be answered: those before an index.
bool has_match_before(const StemDrive& queries, std::size_t query, const StemDrive& map,
                      std::size_t end, double radius_m) {
  const Eigen::Vector2d here = queries.world_T_level[query].translation();
  return std::any_of(
      map.world_T_level.begin(), map.world_T_level.begin() + static_cast<std::ptrdiff_t>(end),
      [&](const geometry::SE2& pose) { return (pose.translation() - here).norm() <= radius_m; });
}

std::size_t first_not_earlier(const StemDrive& drive, std::size_t query, const Protocol& protocol) {
  const std::size_t by_count =
      query >= protocol.frames_earlier ? query - protocol.frames_earlier + 1 : 0;
  const double latest_s = drive.time_s[query] - protocol.seconds_earlier;
  const auto by_time = static_cast<std::size_t>(std::ranges::upper_bound(drive.time_s, latest_s) -
                                                drive.time_s.begin());
  return std::min(by_count, by_time);
}

places::StemRecogniser recogniser_of(const StemDrive& map,
                                     const places::StemRecogniserParameters& parameters) {
  places::StemRecogniser recogniser(parameters);
  for (std::size_t i = 0; i < map.stems.size(); ++i)
    recogniser.add(static_cast<places::FrameId>(i), map.stems[i]);
  return recogniser;
}

/// `end` of a query: the first frame of the map that may not be answered.
template <class End>
Trials all_queries(const StemDrive& queries, const StemDrive& map, const Protocol& protocol,
                   const places::StemRecogniserParameters& parameters, int jobs,
                   const std::atomic<bool>& stop, End&& end_of) {
  const places::StemRecogniser recogniser = recogniser_of(map, parameters);
  Trials result;
  result.trials.resize(queries.stems.size());
  const auto frames = static_cast<double>(std::max<std::size_t>(1, map.stems.size()));
  result.stored_bytes_per_frame = static_cast<double>(recogniser.stored_bytes()) / frames;

  tools::run_in_parallel(queries.stems.size(), jobs, queries.name, stop, [&](std::size_t k) {
    const std::size_t end = end_of(k);
    const double begin_s = tools::thread_time_s();
    const auto answer = recogniser.query(queries.stems[k], static_cast<places::FrameId>(end) - 1);
    const double ms = 1e3 * (tools::thread_time_s() - begin_s);
    result.trials[k] = judged(answer, queries, k, map, protocol);
    result.trials[k].ms = ms;
    result.trials[k].has_match = has_match_before(queries, k, map, end, protocol.radius_m);
  });
  return result;
}

}  // namespace

StemDrive levelled(std::string name, const std::vector<model::StemFrame>& frames) {
  StemDrive drive;
  drive.name = std::move(name);
  for (const model::StemFrame& frame : frames) {
    drive.time_s.push_back(1e-6 * static_cast<double>(frame.utime));
    drive.world_T_level.push_back(model::level_pose(frame));
    std::vector<places::LevelStem> stems;
    stems.reserve(frame.stems.size());
    for (const model::Detection& stem : model::level_scan(frame, 1.0, 0.0).detections)
      stems.push_back({stem.position_m.head<2>(), 2.0 * stem.radius_m});
    drive.stems.push_back(std::move(stems));
  }
  return drive;
}

StemDrive windowed(const StemDrive& drive, std::size_t frames,
                   const places::StemRecogniserParameters& parameters) {
  places::StemChainParameters chain = parameters.chains;
  chain.reach = frames - 1;
  places::StemChains chains(chain, parameters.triangles, parameters.noise);
  places::DiameterStatistics diameters;
  StemDrive result = drive;
  for (std::size_t k = 0; k < drive.stems.size(); ++k) {
    for (const places::LevelStem& stem : drive.stems[k]) diameters.add(stem.diameter_m);
    chains.add(places::PackedStems(drive.stems[k]), diameters.spread());
    const places::StemView view = chains.view(k, k + 1);
    result.stems[k].clear();
    for (std::size_t i = 0; i < view.stems.size(); ++i) {
      if (view.weight[i] >= kLeastSeenWeight) result.stems[k].push_back(view.stems[i]);
    }
  }
  return result;
}

double confidence_of(const places::PlaceAnswer& answer, double radius_m) {
  return places::decades_of(answer, radius_m);
}

Trials within_drive(const StemDrive& drive, const Protocol& protocol,
                    const places::StemRecogniserParameters& parameters, int jobs,
                    const std::atomic<bool>& stop) {
  return all_queries(drive, drive, protocol, parameters, jobs, stop,
                     [&](std::size_t k) { return first_not_earlier(drive, k, protocol); });
}

Trials between_drives(const StemDrive& queries, const StemDrive& map, const Protocol& protocol,
                      const places::StemRecogniserParameters& parameters, int jobs,
                      const std::atomic<bool>& stop) {
  return all_queries(queries, map, protocol, parameters, jobs, stop,
                     [&](std::size_t) { return map.stems.size(); });
}

PlaceScore score_of(const std::vector<Trial>& trials) {
  PlaceScore score;
  std::vector<const Trial*> answered;
  std::size_t right = 0, right_accepted = 0;
  for (const Trial& trial : trials) {
    ++(trial.has_match ? score.queries : score.queries_without_match);
    if (!trial.has_answer) continue;
    answered.push_back(&trial);
    right += trial.is_right ? 1 : 0;
    if (!trial.is_accepted) continue;
    right_accepted += trial.is_right ? 1 : 0;
    score.wrong_accepted += trial.is_right ? 0 : 1;
    score.wrong_accepted_no_match += trial.has_match ? 0 : 1;
  }
  if (score.queries == 0) return score;
  const auto all = static_cast<double>(score.queries);
  score.recall_at_1 = static_cast<double>(right) / all;
  score.recall_accepted = static_cast<double>(right_accepted) / all;

  // Every confidence as threshold, from the highest: answers of one confidence go together.
  std::ranges::sort(answered,
                    [](const Trial* a, const Trial* b) { return a->confidence > b->confidence; });
  double hits = 0.0, wrong = 0.0;
  for (std::size_t i = 0; i < answered.size(); ++i) {
    (answered[i]->is_right ? hits : wrong) += 1.0;
    const bool is_last = i + 1 == answered.size();
    if (!is_last && answered[i + 1]->confidence == answered[i]->confidence) continue;
    score.max_f1 = std::max(score.max_f1, 2.0 * hits / (hits + wrong + all));
    if (wrong == 0.0) score.recall_zero_wrong = hits / all;
  }
  return score;
}

}  // namespace understory::eval::experiments::place_recognition
