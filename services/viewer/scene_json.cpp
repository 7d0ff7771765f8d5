#include "services/viewer/scene_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

namespace understory::viewer {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json number(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

const char* update_text(model::MapUpdateStatus status) {
  switch (status) {
    case model::MapUpdateStatus::kFirstMap:
      return "first map";
    case model::MapUpdateStatus::kUpdated:
      return "localised";
    case model::MapUpdateStatus::kNotSure:
      return "not sure";
    case model::MapUpdateStatus::kRolledBack:
      return "rolled back";
    case model::MapUpdateStatus::kRejected:
      return "rejected";
  }
  return "rejected";
}

const char* pose_text(const model::SlamPose& pose) {
  if (pose.is_lost) return "lost";
  if (pose.is_coasting) return "coasting";
  if (pose.is_new_map) return "new map";
  return pose.status ? update_text(*pose.status) : "tracked";
}

Json pose_json(const model::SlamPose& pose) {
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  Json covariance = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) covariance.push_back(pose.covariance(row, column));
  }
  return {{"utime", pose.utime},
          {"map_id", pose.map_id},
          {"x", map_T_vehicle.x()},
          {"y", map_T_vehicle.y()},
          {"theta", map_T_vehicle.theta()},
          {"covariance", std::move(covariance)},
          {"status", pose_text(pose)},
          {"is_sure", pose.is_localised() && !pose.is_provisional},
          {"is_provisional", pose.is_provisional},
          {"submap_id", pose.submap_id},
          {"correction_version", pose.correction_version}};
}

Json submaps_json(const SubmapPlaces& submaps) {
  Json list = Json::array();
  for (const auto& [id, place] : submaps.places()) {
    Json outline = Json::array();
    for (const Eigen::Vector2d& point : place.outline_m) {
      const Eigen::Vector2d in_map = place.map_T_submap * point;
      outline.push_back({in_map.x(), in_map.y()});
    }
    list.push_back({{"id", id},
                    {"x", place.map_T_submap.x()},
                    {"y", place.map_T_submap.y()},
                    {"theta", place.map_T_submap.theta()},
                    {"outline", std::move(outline)}});
  }
  return list;
}

Json closures_json(const Scene& scene) {
  Json list = Json::array();
  for (const auto& [id, one] : scene.closures()) {
    const auto from = scene.place_of(one.closure.from);
    const auto to = scene.place_of(one.closure.to);
    if (!from || !to) continue;
    list.push_back({{"id", id},
                    {"source", one.closure.source},
                    {"status", one.status},
                    {"reason", one.reason},
                    {"from", {from->x(), from->y()}},
                    {"to", {to->x(), to->y()}}});
  }
  return list;
}

const char* state_text(const ProcessBoard::Entry& entry) {
  if (entry.health.state == health_t::STATE_STOPPING) return "stopping";
  if (entry.is_silent) return "silent";
  switch (entry.health.state) {
    case health_t::STATE_STARTING:
      return "starting";
    case health_t::STATE_OK:
      return "ok";
    case health_t::STATE_DEGRADED:
      return "degraded";
    default:
      return "error";
  }
}

Json process_json(const std::string& name, const ProcessBoard::Entry& entry, std::int64_t wall_us) {
  const health_t& health = entry.health;
  Json reasons = Json::array();
  for (const auto& one : health.reasons) reasons.push_back({one.channel, one.reason, one.count});
  Json channels = Json::array();
  for (const auto& one : health.channels) {
    channels.push_back({{"channel", one.channel},
                        {"is_output", one.output != 0},
                        {"rate_hz", one.rate_hz},
                        {"messages", one.messages},
                        {"lost", one.lost},
                        {"malformed", one.malformed},
                        {"dropped", one.dropped},
                        {"last_utime", one.last_utime}});
  }
  return {
      {"name", name},
      {"state", state_text(entry)},
      {"silent_s", 1e-6 * static_cast<double>(std::max<std::int64_t>(0, wall_us - entry.heard_us))},
      {"uptime_s", health.uptime_s},
      {"version", health.version},
      {"latency_p50_us", health.latency_p50_us},
      {"latency_p90_us", health.latency_p90_us},
      {"latency_p99_us", health.latency_p99_us},
      {"latency_max_us", health.latency_max_us},
      {"rss_bytes", health.rss_bytes},
      {"cpu_share", number(entry.cpu_share)},
      {"handled", health.handled},
      {"message_utime", health.message_utime},
      {"last_error_code", health.last_error_code},
      {"last_error",
       entry.has_ended ? "the process has ended, or was stopped by a signal" : health.last_error},
      {"reasons", std::move(reasons)},
      {"channels", std::move(channels)}};
}

Json numbers_json(const SceneNumbers& numbers) {
  std::optional<double> error_deg = numbers.error_rad;
  if (error_deg) *error_deg *= 180.0 / std::numbers::pi;
  return {{"error_m", number(numbers.error_m)},
          {"error_deg", number(error_deg)},
          {"nees", number(numbers.nees)},
          {"nis", number(numbers.nis)},
          {"nis_dof", numbers.nis_dof},
          {"rate_hz", number(numbers.rate_hz)},
          {"latency_ms", number(numbers.latency_ms)},
          {"missing_share", number(numbers.missing_share)},
          {"new_share", number(numbers.new_share)},
          {"is_mapping_needed", numbers.is_mapping_needed}};
}

Json log_json(const Scene& scene, Change since) {
  static constexpr const char* kLevels[] = {"debug", "info", "warning", "error"};
  Json list = Json::array();
  for (const Part<log_t>& part : scene.log()) {
    if (part.change <= since) continue;
    const log_t& line = part.value;
    list.push_back({{"utime", line.utime},
                    {"process", line.process},
                    {"level", kLevels[std::clamp<int>(line.level, 0, 3)]},
                    {"channel", line.channel},
                    {"code", line.code},
                    {"text", line.text}});
  }
  return list;
}

}  // namespace

nlohmann::ordered_json matches_json(const model::MapUpdate& update) {
  return {{"keyframe_seq", update.keyframe_sequence},
          {"status", update_text(update.status)},
          {"reason", update.reason},
          {"x", update.map_T_vehicle.x()},
          {"y", update.map_T_vehicle.y()},
          {"theta", update.map_T_vehicle.theta()}};
}

void add_parts(const Scene& scene, Change since, nlohmann::ordered_json& header) {
  if (scene.pose().change > since && scene.pose().value)
    header["pose"] = pose_json(*scene.pose().value);
  if (scene.verdict().change > since)
    header["verdict"] = {{"state", state_name(scene.verdict().value.state)},
                         {"text", scene.verdict().value.text},
                         {"since_utime", scene.verdict().value.since_utime}};
  if (scene.true_pose().change > since && scene.true_pose().value) {
    const geometry::SE2& truth = *scene.true_pose().value;
    header["truth"] = {{"x", truth.x()}, {"y", truth.y()}, {"theta", truth.theta()}};
  }

  if (scene.submaps_change() > since) header["submaps"] = submaps_json(scene.submaps());
  if (scene.closures_change() > since) header["closures"] = closures_json(scene);
  if (scene.processes().change() > since) {
    Json list = Json::array();
    for (const auto& [name, entry] : scene.processes().entries())
      list.push_back(process_json(name, entry, scene.processes().looked_us()));
    header["processes"] = std::move(list);
  }
  header["numbers"] = numbers_json(scene.numbers().value);
  if (!scene.log().empty() && scene.log().back().change > since)
    header["log"] = log_json(scene, since);
}

}  // namespace understory::viewer
