#include "services/geoslam_mapper/health_watch.hpp"

#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper {
namespace {

/// Number of keyframes in doubt after a loop closure that contradicts the graph.
constexpr int kDoubtfulKeyframes = 50;

}  // namespace

void describe(HealthParameters& p, bus::ParameterTable& table) {
  table.add("health.innovation_sigmas", p.innovation_sigmas, {1.0, 100.0}, "sigma",
            "A keyframe fits badly if the chi^2 of its associations exceeds its expectation by "
            "this many standard deviations.");
  table.add("health.filter_disagreement_m", p.filter_disagreement_m, {0.01, 1000.0}, "m",
            "Two keyframes contradict the filter where the motion between them differs by more.");
  describe(p.lost, "lost", "keyframes", "those without a certain pose.", table);
  describe(p.rolled_back, "rolled_back", "keyframes", "those that were rolled back.", table);
  describe(p.diverged, "diverged", "keyframes",
           "those that fit badly; separately, those that contradict the filter.", table);
  describe(p.refused, "refused", "keyframes", "those that are malformed or late.", table);
  describe(p.coasting, "coasting", "scans", "those whose pose is from odometry only.", table);
  describe(p.new_map, "new_map", "keyframes", "those that started a map beside another one.",
           table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : parameters_(parameters),
      lost_{wire::Reason::kLost, "keyframes come, and none has a certain pose", "",
            bus::Condition(parameters.lost)},
      unconfirmed_{wire::Reason::kLost,
                   "odometry alone places keyframes: few landmarks match there, and no other "
                   "place is found",
                   "ODOMETRY", bus::Condition(parameters.lost)},
      rolled_back_{wire::Reason::kRolledBack, "keyframes contradict the map", "",
                   bus::Condition(parameters.rolled_back)},
      diverged_{wire::Reason::kDiverged, "keyframes fit the map worse than is stated", "",
                bus::Condition(parameters.diverged)},
      contradicts_{wire::Reason::kDiverged, "the map's motion is not the filter's", "EKF_POSE",
                   bus::Condition(parameters.diverged)},
      closure_{wire::Reason::kDiverged,
               "a loop closure contradicts the graph: poses may be off by more than they state",
               "LOOP_CLOSURE", bus::Condition({1, 1})},
      refused_{wire::Reason::kInputRefused, "keyframes are malformed or late", "",
               bus::Condition(parameters.refused)},
      new_map_{wire::Reason::kNewMap, "another map was begun; the one before is not continued", "",
               bus::Condition(parameters.new_map)},
      not_stored_{wire::Reason::kNotStored,
                  "nobody confirms SUBMAP: the map stays in memory and grows", "SUBMAP",
                  bus::Condition({1, 1})},
      coasting_{wire::Reason::kLost,
                "odometry alone gives the poses of scans: their landmarks do not match the map",
                "SLAM_POSE", bus::Condition(parameters.coasting)} {}

void HealthWatch::add(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  const bool has_corrected_graph = result.status == kAccepted && !result.reason.empty();
  if (result.status == kWaiting || has_corrected_graph) doubtful_keyframes_ = kDoubtfulKeyframes;
}

void HealthWatch::add(const model::MapUpdate& update) {
  using enum model::MapUpdateStatus;
  refused_.condition.add(update.status == kRejected);
  if (update.status == kRejected) return;
  closure_.condition.add(doubtful_keyframes_ > 0);
  doubtful_keyframes_ = std::max(0, doubtful_keyframes_ - 1);

  const bool is_another = map_id_ != 0 && update.map_id != map_id_;
  map_id_ = update.map_id;
  new_map_.condition.add(is_another);
  if (is_another) last_.reset();

  const bool is_localised = update.status == kFirstMap || update.status == kUpdated;
  const int weight = must_find_map_ && !is_localised ? parameters_.lost.raise_at : 1;
  for (int i = 0; i < weight; ++i) lost_.condition.add(!is_localised);
  must_find_map_ = must_find_map_ && !is_localised;
  rolled_back_.condition.add(update.status == kRolledBack);
  if (!is_localised) return;

  unconfirmed_.condition.add(!update.reason.empty());
  if (update.degrees_of_freedom > 0) {
    const auto degrees = static_cast<double>(update.degrees_of_freedom);
    diverged_.condition.add((update.chi2 - degrees) / std::sqrt(2.0 * degrees) >
                            parameters_.innovation_sigmas);
  }
  compare(update);
}

void HealthWatch::compare(const model::MapUpdate& update) {
  const std::optional<geometry::SE2> filtered =
      last_ ? filter_.between(last_->utime, update.utime) : std::nullopt;
  if (filtered) {
    const geometry::SE2 mapped = last_->map_T_vehicle.inverse() * update.map_T_vehicle;
    contradicts_.condition.add((filtered->inverse() * mapped).translation().norm() >
                               parameters_.filter_disagreement_m);
  }
  last_ = CertainKeyframe{update.utime, update.map_T_vehicle};
}

}  // namespace understory::geoslam_mapper
