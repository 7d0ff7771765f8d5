#include "services/keyframer/baseline/keyframer_state.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace understory::keyframer::baseline {
namespace {

using Json = nlohmann::json;

Json to_json(const Observation& observation) {
  Json detections = Json::array();
  for (std::size_t i = 0; i < observation.points.size(); ++i) {
    detections.push_back({observation.points[i].x(), observation.points[i].y(),
                          observation.radii_m[i], static_cast<int>(observation.kinds[i])});
  }
  const hierarchy::baseline::Similarity& pose = observation.base_T_vehicle;
  const model::FieldOfView& view = observation.field_of_view;
  return {{"number", observation.number},
          {"utime", observation.utime},
          {"sequence", observation.sequence},
          {"view", {view.max_range_m, view.bearing_rad, view.width_rad}},
          {"pose", {pose.cosine, pose.sine, pose.translation_m.x(), pose.translation_m.y()}},
          {"is_base", observation.is_base},
          {"detections", std::move(detections)}};
}

Observation observation_from(const Json& json, double descriptor_step) {
  Observation observation;
  json.at("number").get_to(observation.number);
  json.at("utime").get_to(observation.utime);
  json.at("sequence").get_to(observation.sequence);
  const auto view = json.at("view").get<std::array<double, 3>>();
  observation.field_of_view = {view[0], view[1], view[2]};
  const auto pose = json.at("pose").get<std::array<double, 4>>();
  observation.base_T_vehicle = {pose[0], pose[1], Eigen::Vector2d(pose[2], pose[3])};
  json.at("is_base").get_to(observation.is_base);
  for (const Json& detection : json.at("detections")) {
    observation.points.emplace_back(detection.at(0).get<double>(), detection.at(1).get<double>());
    observation.radii_m.push_back(detection.at(2).get<double>());
    observation.kinds.push_back(static_cast<model::LandmarkKind>(detection.at(3).get<int>()));
  }
  observation.hierarchy = hierarchy::baseline::Hierarchy(observation.points, descriptor_step);
  return observation;
}

Json list_to_json(const std::vector<Observation>& observations) {
  Json list = Json::array();
  for (const Observation& observation : observations) {
    list.push_back(to_json(observation));
  }
  return list;
}

std::vector<Observation> list_from(const Json& json, double descriptor_step) {
  std::vector<Observation> observations;
  for (const Json& item : json) {
    observations.push_back(observation_from(item, descriptor_step));
  }
  return observations;
}

}  // namespace

std::string save(const KeyframerState& state) {
  const KeyframerCounters& counters = state.counters;
  const Json json{{"scans", counters.scans},
                  {"scans_unmatched", counters.scans_unmatched},
                  {"keyframes", counters.keyframes},
                  {"keyframes_withheld", counters.keyframes_withheld},
                  {"last_reason", counters.last_reason},
                  {"waiting", list_to_json(state.waiting)},
                  {"members", list_to_json(state.members)}};
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

KeyframerState load_keyframer_state(const std::string& bytes, double descriptor_step) {
  try {
    const Json json = Json::from_cbor(bytes);
    KeyframerState state;
    json.at("scans").get_to(state.counters.scans);
    json.at("scans_unmatched").get_to(state.counters.scans_unmatched);
    json.at("keyframes").get_to(state.counters.keyframes);
    json.at("keyframes_withheld").get_to(state.counters.keyframes_withheld);
    json.at("last_reason").get_to(state.counters.last_reason);
    state.waiting = list_from(json.at("waiting"), descriptor_step);
    state.members = list_from(json.at("members"), descriptor_step);
    return state;
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("state of the source's keyframer: ") + error.what());
  }
}

}  // namespace understory::keyframer::baseline
