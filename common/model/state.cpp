#include "common/model/state.hpp"

#include <stdexcept>

namespace understory::geometry {

void to_json(nlohmann::json& json, const SE2& pose) { json = {pose.x(), pose.y(), pose.theta()}; }
void from_json(const nlohmann::json& json, SE2& pose) {
  pose = SE2(json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>());
}

void to_json(nlohmann::json& json, const SE2WithCovariance& pose) {
  json = {pose.mean, model::matrix_to_json<3, 3>(pose.covariance)};
}
void from_json(const nlohmann::json& json, SE2WithCovariance& pose) {
  pose.mean = json.at(0).get<SE2>();
  pose.covariance = model::matrix_from_json<3, 3>(json.at(1));
}

}  // namespace understory::geometry

namespace understory::model {

std::string to_state(const Json& json) {
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return {bytes.begin(), bytes.end()};
}

Json from_state(const std::string& state) {
  Json json = Json::from_cbor(state.begin(), state.end(), true, false);
  if (json.is_discarded()) throw std::invalid_argument("state: not a valid CBOR document");
  return json;
}

void to_json(Json& json, const Detection& d) {
  json = {matrix_to_json<3, 1>(d.position_m),
          matrix_to_json<3, 3>(d.covariance_m2),
          d.radius_m,
          static_cast<int>(d.kind),
          d.bearing_rad,
          d.bearing_sigma_rad};
}
void from_json(const Json& json, Detection& d) {
  d.position_m = matrix_from_json<3, 1>(json.at(0));
  d.covariance_m2 = matrix_from_json<3, 3>(json.at(1));
  d.radius_m = json.at(2).get<double>();
  d.kind = static_cast<LandmarkKind>(json.at(3).get<int>());
  d.bearing_rad = json.at(4).get<double>();
  d.bearing_sigma_rad = json.at(5).get<double>();
}

void to_json(Json& json, const FieldOfView& view) {
  json = {view.max_range_m, view.bearing_rad, view.width_rad};
}
void from_json(const Json& json, FieldOfView& view) {
  view = {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

void to_json(Json& json, const LandmarkScan& scan) {
  json = {{"utime", scan.utime},
          {"sequence", scan.sequence},
          {"view", scan.field_of_view},
          {"detections", scan.detections}};
}
void from_json(const Json& json, LandmarkScan& scan) {
  scan.utime = json.at("utime").get<Utime>();
  scan.sequence = json.at("sequence").get<std::uint64_t>();
  scan.field_of_view = json.at("view").get<FieldOfView>();
  scan.detections = json.at("detections").get<std::vector<Detection>>();
}

void to_json(Json& json, const Preintegration& p) {
  json = {p.seconds,
          p.yaw_rad,
          matrix_to_json<2, 1>(p.velocity_mps),
          matrix_to_json<2, 1>(p.position_m),
          matrix_to_json<5, 5>(p.covariance),
          matrix_to_json<5, 3>(p.bias_jacobian),
          matrix_to_json<3, 1>(p.bias),
          matrix_to_json<2, 2>(p.level.covariance),
          matrix_to_json<2, 2>(p.level.memory),
          matrix_to_json<2, 2>(p.level.added),
          p.level.pitch_tangent};
}
void from_json(const Json& json, Preintegration& p) {
  p.seconds = json.at(0).get<double>();
  p.yaw_rad = json.at(1).get<double>();
  p.velocity_mps = matrix_from_json<2, 1>(json.at(2));
  p.position_m = matrix_from_json<2, 1>(json.at(3));
  p.covariance = matrix_from_json<5, 5>(json.at(4));
  p.bias_jacobian = matrix_from_json<5, 3>(json.at(5));
  p.bias = matrix_from_json<3, 1>(json.at(6));
  p.level.covariance = matrix_from_json<2, 2>(json.at(7));
  p.level.memory = matrix_from_json<2, 2>(json.at(8));
  p.level.added = matrix_from_json<2, 2>(json.at(9));
  p.level.pitch_tangent = json.at(10).get<double>();
}

void to_json(Json& json, const Odometry& odometry) {
  json = {odometry.from_utime,
          odometry.utime,
          odometry.sequence,
          odometry.from_T_to,
          matrix_to_json<3, 3>(odometry.covariance),
          optional_to_json(odometry.inertial),
          odometry.has_wheels,
          odometry.is_stationary};
}
void from_json(const Json& json, Odometry& odometry) {
  odometry.from_utime = json.at(0).get<Utime>();
  odometry.utime = json.at(1).get<Utime>();
  odometry.sequence = json.at(2).get<std::uint64_t>();
  odometry.from_T_to = json.at(3).get<geometry::SE2>();
  odometry.covariance = matrix_from_json<3, 3>(json.at(4));
  odometry.inertial = optional_from_json<Preintegration>(json.at(5));
  odometry.has_wheels = json.at(6).get<bool>();
  odometry.is_stationary = json.at(7).get<bool>();
}

void to_json(Json& json, const OdometryBuffer& buffer) {
  Json increments = Json::array();
  for (const Odometry& increment : buffer.increments()) increments.push_back(increment);
  json = {increments, buffer.bias() ? matrix_to_json<3, 1>(*buffer.bias()) : Json(nullptr),
          nullptr};
  if (const auto& known = buffer.velocity()) {
    json[2] = {known->utime, matrix_to_json<2, 1>(known->velocity_mps),
               matrix_to_json<2, 2>(known->covariance), known->gyro_bias_variance};
  }
}
void to_json(Json& json, const LevelCorrection& level) {
  json = nullptr;
  if (const auto& known = level.latest()) {
    json = {known->utime, known->sequence, matrix_to_json<2, 1>(known->error_rad),
            matrix_to_json<2, 2>(known->covariance),
            matrix_to_json<2, 2>(known->reported_covariance)};
  }
}
void from_json(const Json& json, LevelCorrection& level) {
  level.restore(std::nullopt);
  if (json.is_null()) return;
  level.restore(EkfLevel{json.at(0).get<Utime>(), json.at(1).get<std::uint64_t>(),
                         matrix_from_json<2, 1>(json.at(2)), matrix_from_json<2, 2>(json.at(3)),
                         matrix_from_json<2, 2>(json.at(4))});
}
void from_json(const Json& json, OdometryBuffer& buffer) {
  for (const Json& increment : json.at(0)) buffer.restore(increment.get<Odometry>());
  if (!json.at(1).is_null()) buffer.set_bias(matrix_from_json<3, 1>(json.at(1)));
  if (json.size() < 3 || json.at(2).is_null()) return;
  const Json& known = json.at(2);
  buffer.restore(VelocityEstimate{known.at(0).get<Utime>(), matrix_from_json<2, 1>(known.at(1)),
                                  matrix_from_json<2, 2>(known.at(2)), known.at(3).get<double>()});
}

}  // namespace understory::model
