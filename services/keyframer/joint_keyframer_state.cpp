// Saving and loading the joint keyframer.
#include "common/model/state.hpp"
#include "services/keyframer/joint_keyframer.hpp"

namespace understory::keyframer {
namespace {

constexpr int kStateVersion = 3;

model::Json to_json_value(const Track& t) {
  return {t.id,
          model::matrix_to_json<2, 1>(t.position_m),
          t.detection_variance_m2,
          t.radius_m,
          t.observations,
          t.seen,
          t.in_view,
          static_cast<int>(t.kind)};
}

Track track_from(const model::Json& json) {
  Track t;
  t.id = json.at(0).get<std::uint32_t>();
  t.position_m = model::matrix_from_json<2, 1>(json.at(1));
  t.detection_variance_m2 = json.at(2).get<double>();
  t.radius_m = json.at(3).get<double>();
  t.observations = json.at(4).get<std::uint32_t>();
  t.seen = json.at(5).get<std::uint64_t>();
  t.in_view = json.at(6).get<std::uint64_t>();
  t.kind = static_cast<model::LandmarkKind>(json.at(7).get<int>());
  return t;
}

model::Json tracker_to_json(const ScanTracker::State& state) {
  model::Json tracks = model::Json::array();
  for (const Track& track : state.tracks) tracks.push_back(to_json_value(track));
  return {
      {"tracks", tracks},         {"merged", state.merged},        {"next_id", state.next_id},
      {"started", state.started}, {"pose", state.local_T_vehicle}, {"motion", state.last_motion}};
}

ScanTracker::State tracker_from(const model::Json& json) {
  ScanTracker::State state;
  for (const model::Json& track : json.at("tracks")) state.tracks.push_back(track_from(track));
  json.at("merged").get_to(state.merged);
  json.at("next_id").get_to(state.next_id);
  json.at("started").get_to(state.started);
  json.at("pose").get_to(state.local_T_vehicle);
  json.at("motion").get_to(state.last_motion);
  return state;
}

}  // namespace

std::string JointKeyframer::save() const {
  model::Json members = model::Json::array();
  for (const Member& member : members_) {
    members.push_back({{"scan", member.scan},
                       {"pose", member.tracked.local_T_vehicle},
                       {"tracks", member.tracked.tracks},
                       {"motion", model::optional_to_json(member.motion)}});
  }
  return model::to_state({{"version", kStateVersion},
                          {"tracker", tracker_to_json(tracker_.state())},
                          {"members", members},
                          {"odometry", odometry_},
                          {"last_utime", model::optional_to_json(last_utime_)},
                          {"next_sequence", next_sequence_},
                          {"previous_base", model::optional_to_json(local_T_previous_base_)},
                          {"level", level_},
                          {"counters",
                           {counters_.scans, counters_.scans_unmatched, counters_.keyframes,
                            counters_.keyframes_withheld, counters_.last_reason}}});
}

void JointKeyframer::load(const std::string& state) {
  const model::Json json = model::from_state(state);
  if (json.at("version").get<int>() != kStateVersion) {
    throw std::invalid_argument("keyframer: state of another version");
  }
  JointKeyframer loaded(parameters_);
  loaded.tracker_.set_state(tracker_from(json.at("tracker")));
  for (const model::Json& member : json.at("members")) {
    Member loaded_member;
    loaded_member.scan = member.at("scan").get<model::LandmarkScan>();
    loaded_member.tracked.tracked = true;
    loaded_member.tracked.local_T_vehicle = member.at("pose").get<geometry::SE2>();
    member.at("tracks").get_to(loaded_member.tracked.tracks);
    loaded_member.motion =
        model::optional_from_json<geometry::SE2WithCovariance>(member.at("motion"));
    loaded.members_.push_back(std::move(loaded_member));
  }
  json.at("odometry").get_to(loaded.odometry_);
  loaded.last_utime_ = model::optional_from_json<model::Utime>(json.at("last_utime"));
  loaded.next_sequence_ = json.at("next_sequence").get<std::uint64_t>();
  loaded.local_T_previous_base_ =
      model::optional_from_json<geometry::SE2>(json.at("previous_base"));
  json.at("level").get_to(loaded.level_);
  const model::Json& counters = json.at("counters");
  loaded.counters_ = {counters.at(0).get<std::uint64_t>(), counters.at(1).get<std::uint64_t>(),
                      counters.at(2).get<std::uint64_t>(), counters.at(3).get<std::uint64_t>(),
                      counters.at(4).get<std::string>()};
  *this = std::move(loaded);
}

}  // namespace understory::keyframer
