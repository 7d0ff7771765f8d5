#include "deploy/cli/drive_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "common/wire/convert.hpp"
#include "sim/point_grid.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

/// Between two true poses the motion is taken to be even if they are no further apart [us].
constexpr model::Utime kLongestGap = 200'000;
constexpr double kTileM = 5.0;

}  // namespace

const char* to_string(MapTie tie) {
  switch (tie) {
    case MapTie::kFirstMap:
      return "the update that started it";
    case MapTie::kFirstKeyframe:
      return "its oldest keyframe (no update that started it in the log)";
    case MapTie::kFirstUpdate:
      return "the first update in the log (neither its start nor a whole MAP in it)";
  }
  return "?";
}

double ComparedPose::position_error_m() const {
  return (world_T_vehicle.translation() - true_world_T_vehicle.translation()).norm();
}

double ComparedPose::heading_error_rad() const {
  return std::abs(geometry::wrap_angle(world_T_vehicle.theta() - true_world_T_vehicle.theta()));
}

void DriveAccuracyCollector::add(const io::LogEvent& event) {
  if (event.channel == "GROUND_TRUTH") {
    const auto truth = wire::decode_message<ground_truth_t>(event.data);
    if (truth) truth_.insert_or_assign(truth->utime, wire::from_wire(truth->world_T_vehicle));
  } else if (event.channel == "TRUTH_LANDMARKS") {
    const auto landmarks = wire::decode_message<truth_landmarks_t>(event.data);
    if (landmarks) true_landmarks_ = *landmarks;
  } else if (event.channel == "LANDMARKS") {
    add_landmarks_event(event);
  } else if (event.channel == "SLAM_POSE") {
    const auto pose = wire::decode_message<model::SlamPose>(event.data);
    if (pose && pose->is_localised()) poses_.push_back(*pose);
  } else if (event.channel == "SLAM_UPDATE") {
    const auto update = wire::decode_message<model::MapUpdate>(event.data);
    if (update) add_update(*update);
  } else if (event.channel == "MAP") {
    const auto map = wire::decode_message<model::WholeMap>(event.data);
    if (map) map_.take(*map);
  } else if (event.channel == "MAP_DELTA") {
    const auto delta = wire::decode_message<model::MapDelta>(event.data);
    if (delta) map_.take(*delta);
  } else if (event.channel == "SUBMAP") {
    const auto submap = wire::decode_message<model::Submap>(event.data);
    if (submap) map_.take(*submap);
  } else if (event.channel == "MAP_CORRECTION") {
    const auto correction = wire::decode_message<model::MapCorrection>(event.data);
    if (correction) map_.take(*correction);
  } else if (event.channel == "HEALTH") {
    const auto health = wire::decode_message<health_t>(event.data);
    if (health) counted_.last_health.insert_or_assign(health->process, *health);
  }
}

void DriveAccuracyCollector::add_update(const model::MapUpdate& update) {
  map_.take(update);
  ++counted_.updates[update.status];
  if (update.map_id != map_id_) updates_.clear();
  map_id_ = update.map_id;
  if (update.status == model::MapUpdateStatus::kFirstMap) first_.emplace(map_id_, update);
  // Those after one with its truth can never be needed.
  const bool is_tied = !updates_.empty() && truth_at(updates_.back().utime);
  if (!is_tied && update.status == model::MapUpdateStatus::kUpdated) updates_.push_back(update);
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

std::optional<geometry::SE2> DriveAccuracyCollector::truth_at(model::Utime utime) const {
  const auto after = truth_.lower_bound(utime);
  if (after == truth_.end()) return std::nullopt;
  if (after->first == utime) return after->second;
  if (after == truth_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->first - before->first > kLongestGap) return std::nullopt;
  const double share = static_cast<double>(utime - before->first) /
                       static_cast<double>(after->first - before->first);
  return before->second *
         geometry::SE2::Exp(share * (before->second.inverse() * after->second).Log());
}

std::optional<ComparedPose> DriveAccuracyCollector::compare(
    model::Utime utime, const geometry::SE2WithCovariance& map_T_vehicle,
    const geometry::SE2& world_T_map, std::uint32_t map_id) const {
  const auto truth = truth_at(utime);
  if (!truth) return std::nullopt;
  return ComparedPose{utime, world_T_map * map_T_vehicle.mean, *truth, map_T_vehicle.covariance,
                      map_id};
}

std::vector<ComparedPose> DriveAccuracyCollector::compared_keyframes(
    const model::WholeMap& whole, const geometry::SE2& world_T_map) const {
  std::set<std::uint64_t> held;
  for (const auto& keyframe : map_.map()->keyframes) held.insert(keyframe.keyframe_sequence);
  std::vector<ComparedPose> compared;
  for (const auto& keyframe : whole.keyframes) {
    auto pose = compare(keyframe.utime, {keyframe.map_T_vehicle, keyframe.covariance}, world_T_map,
                        map_id_);
    if (!pose) continue;
    if (!held.contains(keyframe.keyframe_sequence)) pose->covariance.setZero();
    compared.push_back(*pose);
  }
  return compared;
}

std::optional<std::pair<geometry::SE2, MapTie>> DriveAccuracyCollector::tie(
    std::uint32_t map_id) const {
  const auto at = [&](const auto& pose) -> std::optional<geometry::SE2> {
    const auto truth = truth_at(pose.utime);
    if (!truth) return std::nullopt;
    return *truth * pose.map_T_vehicle.inverse();
  };

  if (const auto first = first_.find(map_id); first != first_.end()) {
    if (const auto world_T_map = at(first->second)) return {{*world_T_map, MapTie::kFirstMap}};
  }
  if (map_id != map_id_) return std::nullopt;
  if (map_.has_whole()) {
    const auto whole = map_.whole();
    for (const auto& keyframe : whole->keyframes) {
      if (const auto world_T_map = at(keyframe)) return {{*world_T_map, MapTie::kFirstKeyframe}};
    }
  }
  for (const auto& update : updates_) {
    if (const auto world_T_map = at(update)) return {{*world_T_map, MapTie::kFirstUpdate}};
  }
  return std::nullopt;
}

std::optional<DriveAccuracy> DriveAccuracyCollector::finish() const {
  const auto tied = tie(map_id_);
  if (!tied) return std::nullopt;
  const geometry::SE2 world_T_map = tied->first;

  DriveAccuracy accuracy = counted_;
  accuracy.tied_at = tied->second;
  std::map<std::uint32_t, std::optional<std::pair<geometry::SE2, MapTie>>> ties{{map_id_, tied}};
  for (const auto& pose : poses_) {
    if (!ties.contains(pose.map_id)) ties.emplace(pose.map_id, tie(pose.map_id));
    const auto& its_tie = ties.at(pose.map_id);
    if (!its_tie) continue;
    const auto compared =
        compare(pose.utime, {pose.map_T_vehicle(), pose.covariance}, its_tie->first, pose.map_id);
    if (compared) accuracy.live.push_back(*compared);
  }
  for (const auto& landmark : true_landmarks_.landmarks) {
    accuracy.true_landmarks_m.emplace_back(landmark.position_m[0], landmark.position_m[1]);
  }
  const auto whole = map_.whole();
  if (!whole) return accuracy;
  accuracy.keyframes = compared_keyframes(*whole, world_T_map);
  const sim::PointGrid grid(accuracy.true_landmarks_m, kTileM);
  for (const auto& landmark : whole->landmarks) {
    accuracy.landmarks_m.push_back(world_T_map * landmark.position_m);
    const auto nearest = grid.nearest(accuracy.landmarks_m.back());
    if (nearest) accuracy.landmark_errors_m.push_back(nearest->distance_m);
  }
  return accuracy;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double maximum(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

std::vector<geometry::PosePair> pairs_of(const std::vector<ComparedPose>& poses) {
  std::vector<geometry::PosePair> pairs;
  pairs.reserve(poses.size());
  for (const auto& pose : poses)
    pairs.push_back({pose.world_T_vehicle, pose.true_world_T_vehicle, pose.map_id});
  return pairs;
}

std::vector<double> nees_of(const std::vector<ComparedPose>& poses) {
  std::vector<double> values;
  for (const auto& pose : poses) {
    const auto value =
        geometry::nees({pose.world_T_vehicle, pose.true_world_T_vehicle}, pose.covariance);
    if (value) values.push_back(*value);
  }
  return values;
}

std::vector<double> position_errors_m(const std::vector<ComparedPose>& poses) {
  std::vector<double> errors;
  errors.reserve(poses.size());
  for (const auto& pose : poses) errors.push_back(pose.position_error_m());
  return errors;
}

}  // namespace understory::cli
