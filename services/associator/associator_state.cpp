// Saving and loading the associator.
#include <stdexcept>

#include "common/model/state.hpp"
#include "services/associator/associator.hpp"

namespace understory {
namespace {

constexpr int kStateVersion = 3;

Json track_json(const associator::Track& t) {
  return {t.id,
          matrix_to_json<2, 1>(t.position_m),
          t.detection_variance_m2,
          t.radius_m,
          t.sightings,
          t.history,
          t.age,
          t.missed,
          static_cast<int>(t.kind),
          static_cast<int>(t.steadiness),
          t.times_off,
          t.begin.utime,
          matrix_to_json<2, 1>(t.begin.position_m),
          matrix_to_json<2, 2>(t.begin.covariance_m2)};
}

associator::Track track_from(const Json& json) {
  associator::Track t;
  t.id = json.at(0).get<TrackId>();
  t.position_m = matrix_from_json<2, 1>(json.at(1));
  t.detection_variance_m2 = json.at(2).get<double>();
  t.radius_m = json.at(3).get<double>();
  t.sightings = json.at(4).get<std::uint32_t>();
  t.history = json.at(5).get<std::uint64_t>();
  t.age = json.at(6).get<std::uint32_t>();
  t.missed = json.at(7).get<std::uint32_t>();
  t.kind = static_cast<LandmarkKind>(json.at(8).get<int>());
  t.steadiness = static_cast<associator::Steadiness>(json.at(9).get<int>());
  t.times_off = json.at(10).get<std::uint32_t>();
  t.begin.utime = json.at(11).get<Utime>();
  t.begin.position_m = matrix_from_json<2, 1>(json.at(12));
  t.begin.covariance_m2 = matrix_from_json<2, 2>(json.at(13));
  return t;
}

/// What the next motion is predicted from.
Json filter_pose_json(const std::optional<EkfPose>& pose) {
  if (!pose) return nullptr;
  return {pose->utime, matrix_to_json<2, 1>(pose->velocity_mps),
          matrix_to_json<2, 2>(pose->velocity_covariance), matrix_to_json<3, 1>(pose->bias)};
}

std::optional<EkfPose> filter_pose_from(const Json& json) {
  if (json.is_null()) return std::nullopt;
  EkfPose pose;
  pose.utime = json.at(0).get<Utime>();
  pose.velocity_mps = matrix_from_json<2, 1>(json.at(1));
  pose.velocity_covariance = matrix_from_json<2, 2>(json.at(2));
  pose.bias = matrix_from_json<3, 1>(json.at(3));
  return pose;
}

}  // namespace

std::string Associator::save() const {
  Json tracks = Json::array();
  for (const associator::Track& track : tracks_.tracks()) tracks.push_back(track_json(track));
  Json odometry = Json::array();
  for (const Odometry& piece : odometry_.pieces()) odometry.push_back(piece);
  return to_state({{"version", kStateVersion},
                   {"tracks", tracks},
                   {"next_id", tracks_.next_id()},
                   {"odometry", odometry},
                   {"filter_pose", filter_pose_json(filter_pose_)},
                   {"last_scan", optional_to_json(last_scan_)},
                   {"last_interval_s", last_interval_s_},
                   {"pose", local_T_vehicle_},
                   {"motion", last_motion_},
                   {"misfits", misfits_},
                   {"next_sequence", next_sequence_}});
}

void Associator::load(const std::string& state) {
  const Json json = from_state(state);
  if (json.at("version").get<int>() != kStateVersion) {
    throw std::invalid_argument("state: of another version");
  }
  std::vector<associator::Track> tracks;
  for (const Json& track : json.at("tracks")) tracks.push_back(track_from(track));
  tracks_.set(tracks, json.at("next_id").get<TrackId>());
  odometry_ = OdometryBuffer();
  for (const Json& piece : json.at("odometry")) odometry_.add(piece.get<Odometry>());
  filter_pose_ = filter_pose_from(json.at("filter_pose"));
  last_scan_ = optional_from_json<Utime>(json.at("last_scan"));
  last_interval_s_ = json.at("last_interval_s").get<double>();
  local_T_vehicle_ = json.at("pose").get<SE2>();
  last_motion_ = json.at("motion").get<SE2>();
  misfits_ = json.at("misfits").get<int>();
  next_sequence_ = json.at("next_sequence").get<std::uint64_t>();
}

}  // namespace understory
