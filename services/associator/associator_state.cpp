// Saving and loading the associator.
#include <stdexcept>

#include "common/model/state.hpp"
#include "services/associator/associator.hpp"

namespace understory::associator {
namespace {

constexpr int kStateVersion = 3;

model::Json track_json(const Track& t) {
  return {t.id,
          model::matrix_to_json<2, 1>(t.position_m),
          t.detection_variance_m2,
          t.radius_m,
          t.observations,
          t.history,
          t.age,
          t.missed,
          static_cast<int>(t.kind),
          static_cast<int>(t.steadiness),
          t.times_off,
          t.begin.utime,
          model::matrix_to_json<2, 1>(t.begin.position_m),
          model::matrix_to_json<2, 2>(t.begin.covariance_m2)};
}

Track track_from(const model::Json& json) {
  Track t;
  t.id = json.at(0).get<model::TrackId>();
  t.position_m = model::matrix_from_json<2, 1>(json.at(1));
  t.detection_variance_m2 = json.at(2).get<double>();
  t.radius_m = json.at(3).get<double>();
  t.observations = json.at(4).get<std::uint32_t>();
  t.history = json.at(5).get<std::uint64_t>();
  t.age = json.at(6).get<std::uint32_t>();
  t.missed = json.at(7).get<std::uint32_t>();
  t.kind = static_cast<model::LandmarkKind>(json.at(8).get<int>());
  t.steadiness = static_cast<Steadiness>(json.at(9).get<int>());
  t.times_off = json.at(10).get<std::uint32_t>();
  t.begin.utime = json.at(11).get<model::Utime>();
  t.begin.position_m = model::matrix_from_json<2, 1>(json.at(12));
  t.begin.covariance_m2 = model::matrix_from_json<2, 2>(json.at(13));
  return t;
}

/// What the next motion is predicted from.
model::Json filter_pose_json(const std::optional<model::EkfPose>& pose) {
  if (!pose) return nullptr;
  return {pose->utime, model::matrix_to_json<2, 1>(pose->velocity_mps),
          model::matrix_to_json<2, 2>(pose->velocity_covariance),
          model::matrix_to_json<3, 1>(pose->bias)};
}

std::optional<model::EkfPose> filter_pose_from(const model::Json& json) {
  if (json.is_null()) return std::nullopt;
  model::EkfPose pose;
  pose.utime = json.at(0).get<model::Utime>();
  pose.velocity_mps = model::matrix_from_json<2, 1>(json.at(1));
  pose.velocity_covariance = model::matrix_from_json<2, 2>(json.at(2));
  pose.bias = model::matrix_from_json<3, 1>(json.at(3));
  return pose;
}

}  // namespace

std::string Associator::save() const {
  model::Json tracks = model::Json::array();
  for (const Track& track : tracks_.tracks()) tracks.push_back(track_json(track));
  model::Json odometry = model::Json::array();
  for (const model::Odometry& increment : odometry_.increments()) odometry.push_back(increment);
  return model::to_state({{"version", kStateVersion},
                          {"tracks", tracks},
                          {"next_id", tracks_.next_id()},
                          {"odometry", odometry},
                          {"filter_pose", filter_pose_json(filter_pose_)},
                          {"last_scan", model::optional_to_json(last_scan_)},
                          {"last_interval_s", last_interval_s_},
                          {"pose", local_T_vehicle_},
                          {"motion", last_motion_},
                          {"misfits", misfits_},
                          {"next_sequence", next_sequence_}});
}

void Associator::load(const std::string& state) {
  const model::Json json = model::from_state(state);
  if (json.at("version").get<int>() != kStateVersion) {
    throw std::invalid_argument("state: of another version");
  }
  std::vector<Track> tracks;
  for (const model::Json& track : json.at("tracks")) tracks.push_back(track_from(track));
  tracks_.set(tracks, json.at("next_id").get<model::TrackId>());
  odometry_ = model::OdometryBuffer();
  for (const model::Json& increment : json.at("odometry"))
    odometry_.add(increment.get<model::Odometry>());
  filter_pose_ = filter_pose_from(json.at("filter_pose"));
  last_scan_ = model::optional_from_json<model::Utime>(json.at("last_scan"));
  last_interval_s_ = json.at("last_interval_s").get<double>();
  local_T_vehicle_ = json.at("pose").get<geometry::SE2>();
  last_motion_ = json.at("motion").get<geometry::SE2>();
  misfits_ = json.at("misfits").get<int>();
  next_sequence_ = json.at("next_sequence").get<std::uint64_t>();
}

}  // namespace understory::associator
