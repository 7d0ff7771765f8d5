// Saving and loading the filter.
#include <cstring>
#include <stdexcept>

#include "common/model/state.hpp"
#include "services/ekf/ekf.hpp"

namespace understory::ekf {
namespace {

constexpr int kStateVersion = 4;

model::Json vector_json(const Eigen::Vector2d& v) { return model::matrix_to_json<2, 1>(v); }
Eigen::Vector2d vector_from(const model::Json& json) { return model::matrix_from_json<2, 1>(json); }

model::Json landmark_json(const MapLandmark& l) {
  return {l.id,
          vector_json(l.position),
          vector_json(l.first_position),
          l.radius_m,
          static_cast<int>(l.kind),
          l.observation_count,
          l.missed,
          l.refused,
          l.last_scan,
          l.views,
          l.seen_at_m,
          l.seen_variance_m2,
          l.height_m};
}

MapLandmark landmark_from(const model::Json& json) {
  MapLandmark l;
  l.id = json.at(0).get<model::TrackId>();
  l.position = vector_from(json.at(1));
  l.first_position = vector_from(json.at(2));
  l.radius_m = json.at(3).get<double>();
  l.kind = static_cast<model::LandmarkKind>(json.at(4).get<int>());
  l.observation_count = json.at(5).get<std::uint32_t>();
  l.missed = json.at(6).get<std::uint32_t>();
  l.refused = json.at(7).get<std::uint32_t>();
  l.last_scan = json.at(8).get<std::uint64_t>();
  l.views = json.at(9).get<double>();
  l.seen_at_m = json.at(10).get<double>();
  l.seen_variance_m2 = json.at(11).get<double>();
  l.height_m = json.at(12).get<double>();
  return l;
}

/// The lower triangle, column by column, as bytes: as a list of numbers it would take ten times as
/// long.
model::Json covariance_json(const FilterState& state) {
  const int n = state.size();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(sizeof(double) * static_cast<std::size_t>(n * (n + 1) / 2));
  for (int c = 0; c < n; ++c) {
    for (int r = c; r < n; ++r) {
      const double value = state.covariance(r, c);
      std::uint8_t raw[sizeof(double)];
      std::memcpy(raw, &value, sizeof(double));
      bytes.insert(bytes.end(), raw, raw + sizeof(double));
    }
  }
  return model::Json::binary(std::move(bytes));
}

void load_covariance(const model::Json& json, FilterState& state) {
  const model::Json::binary_t& bytes = json.get_binary();
  const int n = state.size();
  if (bytes.size() != sizeof(double) * static_cast<std::size_t>(n * (n + 1) / 2)) {
    throw std::invalid_argument("state: the covariance has the wrong size");
  }
  const std::uint8_t* at = bytes.data();
  auto covariance = state.covariance();
  for (int c = 0; c < n; ++c) {
    for (int r = c; r < n; ++r, at += sizeof(double)) {
      double value = 0.0;
      std::memcpy(&value, at, sizeof(double));
      covariance(r, c) = value;
    }
  }
}

model::Json filter_json(const FilterState& state) {
  model::Json landmarks = model::Json::array();
  for (const auto& landmark : state.landmarks()) landmarks.push_back(landmark_json(landmark));
  return {{"heading", state.heading},
          {"position", vector_json(state.position)},
          {"velocity", vector_json(state.velocity)},
          {"bias", model::matrix_to_json<3, 1>(state.bias)},
          {"level", vector_json(state.level)},
          {"anchor", vector_json(state.anchor_m)},
          {"first_position", vector_json(state.first_position)},
          {"first_velocity", vector_json(state.first_velocity)},
          {"landmarks", landmarks},
          {"covariance", covariance_json(state)}};
}

void load_filter(const model::Json& json, FilterState& state) {
  state.heading = json.at("heading").get<double>();
  state.position = vector_from(json.at("position"));
  state.velocity = vector_from(json.at("velocity"));
  state.bias = model::matrix_from_json<3, 1>(json.at("bias"));
  state.level = vector_from(json.at("level"));
  state.anchor_m = vector_from(json.at("anchor"));
  state.first_position = vector_from(json.at("first_position"));
  state.first_velocity = vector_from(json.at("first_velocity"));
  std::vector<MapLandmark> landmarks;
  for (const model::Json& landmark : json.at("landmarks"))
    landmarks.push_back(landmark_from(landmark));
  if (landmarks.size() > static_cast<std::size_t>(state.max_landmarks())) {
    throw std::invalid_argument("state: more landmarks than map.max_landmarks");
  }
  state.resize_landmarks(landmarks);
  load_covariance(json.at("covariance"), state);
}

}  // namespace

std::string Ekf::save() const {
  model::Json waiting = model::Json::array();
  for (const model::Odometry& increment : waiting_) waiting.push_back(increment);
  model::Json aliases = model::Json::array();
  for (const Alias& alias : aliases_) aliases.push_back({alias.track, alias.landmark});
  return model::to_state(
      {{"version", kStateVersion},
       {"form", parameters_.error_form},
       {"filter", filter_json(state_)},
       {"started", started_},
       {"heard", model::optional_to_json(heard_)},
       {"utime", utime_},
       {"last_scan", model::optional_to_json(last_scan_)},
       {"waiting", waiting},
       {"aliases", aliases},
       {"scan_count", scan_count_},
       {"pose_sequence", pose_sequence_},
       {"map_sequence", map_sequence_},
       {"reset_counter", reset_counter_},
       {"refused_scans", refused_scans_},
       {"doubted", model::optional_to_json(doubted_)},
       {"way_m", distance_m_},
       {"level_covariance",
        level_covariance_ ? model::matrix_to_json<2, 2>(*level_covariance_) : model::Json(nullptr)},
       {"pitch_tangent", pitch_tangent_},
       {"last_pose", last_sound_.ekf_map_T_vehicle},
       {"last_covariance", model::matrix_to_json<3, 3>(last_sound_.covariance)},
       {"last_bias", model::matrix_to_json<3, 1>(last_sound_.bias)}});
}

void Ekf::load(const std::string& state) {
  const model::Json json = model::from_state(state);
  if (json.at("version").get<int>() != kStateVersion ||
      json.at("form").get<std::string>() != parameters_.error_form) {
    throw std::invalid_argument("state: of another version or error form");
  }
  load_filter(json.at("filter"), state_);
  started_ = json.at("started").get<bool>();
  heard_ = model::optional_from_json<model::Utime>(json.at("heard"));
  utime_ = json.at("utime").get<model::Utime>();
  last_scan_ = model::optional_from_json<model::Utime>(json.at("last_scan"));
  waiting_.clear();
  for (const model::Json& increment : json.at("waiting"))
    waiting_.push_back(increment.get<model::Odometry>());
  aliases_.clear();
  for (const model::Json& alias : json.at("aliases")) {
    aliases_.push_back({alias.at(0).get<model::TrackId>(), alias.at(1).get<model::TrackId>()});
  }
  scan_count_ = json.at("scan_count").get<std::uint64_t>();
  pose_sequence_ = json.at("pose_sequence").get<std::uint64_t>();
  map_sequence_ = json.at("map_sequence").get<std::uint64_t>();
  reset_counter_ = json.at("reset_counter").get<std::uint64_t>();
  refused_scans_ = json.at("refused_scans").get<int>();
  doubted_ = json.contains("doubted") ? model::optional_from_json<model::Utime>(json.at("doubted"))
                                      : std::nullopt;
  distance_m_ = json.at("way_m").get<double>();
  const model::Json& level = json.at("level_covariance");
  level_covariance_.reset();
  if (!level.is_null()) level_covariance_ = model::matrix_from_json<2, 2>(level);
  pitch_tangent_ = json.at("pitch_tangent").get<double>();
  last_sound_ = model::EkfPose{};
  last_sound_.ekf_map_T_vehicle = json.at("last_pose").get<geometry::SE2>();
  last_sound_.covariance = model::matrix_from_json<3, 3>(json.at("last_covariance"));
  last_sound_.bias = model::matrix_from_json<3, 1>(json.at("last_bias"));
}

}  // namespace understory::ekf
