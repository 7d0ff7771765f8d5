#include "deploy/cli/drive_accuracy.hpp"

#include <set>
#include <utility>

#include "common/wire/convert.hpp"
#include "sim/point_grid.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

constexpr double kTileM = 5.0;

/// Calls `take` with the message, if the bytes are valid.
template <class Message, class Take>
void with(const io::LogEvent& event, const Take& take) {
  const auto message = wire::decode_message<Message>(event.data);
  if (message) take(*message);
}

}  // namespace

LandmarkAccuracy compare_landmarks(std::vector<Eigen::Vector2d> landmarks_m,
                                   const std::vector<bool>& is_compared,
                                   std::vector<Eigen::Vector2d> true_landmarks_m) {
  LandmarkAccuracy accuracy;
  const sim::PointGrid grid(true_landmarks_m, kTileM);
  std::map<std::uint32_t, std::uint64_t> landmarks_of;
  for (std::size_t i = 0; i < landmarks_m.size(); ++i) {
    const auto nearest = is_compared[i] ? grid.nearest(landmarks_m[i]) : std::nullopt;
    if (!nearest) continue;
    accuracy.errors_m.push_back(nearest->distance_m);
    if (nearest->distance_m > kDoubleWithin_m) continue;
    ++accuracy.at_a_true_one;
    accuracy.double_pairs += landmarks_of[nearest->index]++;
  }

  accuracy.landmarks_m = std::move(landmarks_m);
  accuracy.true_landmarks_m = std::move(true_landmarks_m);
  return accuracy;
}

void DriveAccuracyCollector::add(const io::LogEvent& event) {
  counter_.take(event);
  if (event.channel == "LANDMARKS") {
    add_landmarks_event(event);
  } else if (event.channel == "SLAM_POSE") {
    with<model::SlamPose>(event, [&](const auto& pose) { add_pose(pose, event.utime); });
  } else if (event.channel == "SLAM_UPDATE") {
    with<model::MapUpdate>(event, [&](const auto& update) { add_update(update); });
  } else if (event.channel == "LOOP_CLOSURE") {
    with<model::LoopClosure>(event, [&](const auto& closure) { counter_.take(closure); });
  } else if (event.channel == "LOOP_RESULT") {
    with<model::LoopResult>(event, [&](const auto& result) { counter_.take(result); });
  } else {
    add_truth(event);
    add_map(event);
    add_words(event);
  }
}

void DriveAccuracyCollector::add_truth(const io::LogEvent& event) {
  if (event.channel == "GROUND_TRUTH") {
    with<ground_truth_t>(event, [&](const auto& truth) {
      truth_.add(truth.utime, wire::from_wire(truth.world_T_vehicle));
    });
  } else if (event.channel == "TRUTH_LANDMARKS") {
    with<truth_landmarks_t>(event, [&](const auto& landmarks) { true_landmarks_ = landmarks; });
  }
}

void DriveAccuracyCollector::add_map(const io::LogEvent& event) {
  const auto take = [&](const auto& part) { map_.take(part); };
  if (event.channel == "MAP") {
    with<model::WholeMap>(event, take);
  } else if (event.channel == "MAP_DELTA") {
    with<model::MapDelta>(event, take);
  } else if (event.channel == "SUBMAP") {
    with<model::Submap>(event, take);
  } else if (event.channel == "MAP_CORRECTION") {
    with<model::MapCorrection>(event, take);
  } else if (event.channel == "GIVEN_MAP") {
    ties_.take_given_map();
  }
}

/// Takes HEALTH, LOG and CONFIG of processes.
void DriveAccuracyCollector::add_words(const io::LogEvent& event) {
  if (event.channel == "HEALTH") {
    with<health_t>(event, [&](const auto& health) {
      counted_.last_health.insert_or_assign(health.process, health);
      alarms_.take(health, event.utime);
    });
  } else if (event.channel == "LOG") {
    with<log_t>(event, [&](const auto& message) { alarms_.take(message, event.utime); });
  } else if (event.channel == "CONFIG") {
    with<config_t>(event, [&](const auto& config) { ties_.take(config); });
  }
}

void DriveAccuracyCollector::add_pose(const model::SlamPose& pose, std::int64_t log_utime) {
  counter_.take(pose);
  if (pose.is_localised() || pose.is_coasting) poses_.push_back({pose, log_utime});
}

void DriveAccuracyCollector::add_update(const model::MapUpdate& update) {
  counter_.take(update);
  map_.take(update);
  ties_.take(update);
  ++counted_.updates[update.status];
  for (const auto& pair : update.associations) seen_.insert(pair.landmark_id);
  seen_.insert(update.added.begin(), update.added.end());
  for (const auto& [old_id, new_id] : update.merged)
    if (seen_.contains(old_id)) seen_.insert(new_id);
}

void DriveAccuracyCollector::add_landmarks_event(const io::LogEvent& event) {
  const auto header = wire::header_of(event.data);
  if (!header) return;
  ++counted_.scans;
  if (last_scan_ && header->sequence > *last_scan_ + 1) {
    counted_.log_lost += static_cast<std::uint64_t>(header->sequence - *last_scan_ - 1);
  }
  last_scan_ = header->sequence;
}

std::optional<ComparedPose> DriveAccuracyCollector::compare(
    model::Utime utime, const geometry::SE2WithCovariance& map_T_vehicle, const TiedMap& tied,
    std::uint32_t map_id) const {
  const auto truth = truth_.at(utime);
  if (!truth) return std::nullopt;
  ComparedPose pose{utime, tied.world_T_map * map_T_vehicle.mean, *truth, map_T_vehicle.covariance,
                    map_id};
  if (pose.covariance.isZero(0.0)) return pose;

  std::optional<geometry::SE2> tie_T_vehicle;
  if (tied.true_world_T_vehicle) tie_T_vehicle = tied.true_world_T_vehicle->inverse() * *truth;
  pose.covariance += geometry::covariance_of_truth(truth_sigma_, tie_T_vehicle);
  return pose;
}

std::vector<ComparedPose> DriveAccuracyCollector::compare_live(DriveAccuracy& accuracy) const {
  std::vector<ComparedPose> all;
  std::map<std::uint32_t, std::optional<TiedMap>> ties;
  for (const auto& [pose, log_utime] : poses_) {
    const auto [tie, is_new] = ties.try_emplace(pose.map_id);
    if (is_new) tie->second = ties_.tie(pose.map_id, truth_, map_);
    if (!tie->second) continue;
    auto compared =
        compare(pose.utime, {pose.map_T_vehicle(), pose.covariance}, *tie->second, pose.map_id);
    if (!compared) continue;
    compared->log_utime = log_utime;
    (pose.is_coasting ? accuracy.coasting : accuracy.live).push_back(*compared);
    all.push_back(*compared);
  }
  return all;
}

std::vector<ComparedPose> DriveAccuracyCollector::compare_keyframes(const model::WholeMap& whole,
                                                                    const TiedMap& tied) const {
  std::set<std::uint64_t> held;
  for (const auto& keyframe : map_.map()->keyframes) held.insert(keyframe.keyframe_sequence);
  std::vector<ComparedPose> compared;
  for (const auto& keyframe : whole.keyframes) {
    auto pose = compare(keyframe.utime, {keyframe.map_T_vehicle, keyframe.covariance}, tied,
                        ties_.last_map_id());
    if (!pose) continue;
    if (!held.contains(keyframe.keyframe_sequence)) pose->covariance.setZero();
    compared.push_back(*pose);
  }
  return compared;
}

LandmarkAccuracy DriveAccuracyCollector::compare_map(const model::WholeMap& whole,
                                                     const geometry::SE2& world_T_map) const {
  std::vector<Eigen::Vector2d> landmarks_m;
  std::vector<bool> is_compared;
  for (const auto& landmark : whole.landmarks) {
    landmarks_m.push_back(world_T_map * landmark.position_m);
    is_compared.push_back(!ties_.has_given_map() || seen_.contains(landmark.id));
  }
  std::vector<Eigen::Vector2d> true_landmarks_m;
  for (const auto& landmark : true_landmarks_.landmarks)
    true_landmarks_m.emplace_back(landmark.position_m[0], landmark.position_m[1]);
  return compare_landmarks(std::move(landmarks_m), is_compared, std::move(true_landmarks_m));
}

std::optional<DriveAccuracy> DriveAccuracyCollector::finish() const {
  const auto tied = ties_.tie(ties_.last_map_id(), truth_, map_);
  if (!tied) return std::nullopt;

  DriveAccuracy accuracy = counted_;
  accuracy.tied_at = tied->tie;
  accuracy.counts = counter_.counts();
  accuracy.has_alarms = alarms_.has_any();
  accuracy.wrong_stretches = wrong_stretches(compare_live(accuracy), alarms_.alarms());

  const auto whole = map_.whole();
  accuracy.landmarks = compare_map(whole.value_or(model::WholeMap{}), tied->world_T_map);
  if (whole) accuracy.keyframes = compare_keyframes(*whole, *tied);
  return accuracy;
}

}  // namespace understory::cli
