// Values as JSON, for the saved state of stages (stored as CBOR: exact doubles, compact).
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common/geometry/se2.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/level.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/odometry_buffer.hpp"

namespace understory::geometry {

void to_json(nlohmann::json& json, const SE2& pose);
void from_json(const nlohmann::json& json, SE2& pose);
void to_json(nlohmann::json& json, const SE2WithCovariance& pose);
void from_json(const nlohmann::json& json, SE2WithCovariance& pose);

}  // namespace understory::geometry

namespace understory::model {

using Json = nlohmann::json;

/// CBOR bytes of a state, and back. from_state() throws std::invalid_argument where the bytes are
/// no CBOR.
std::string to_state(const Json& json);
Json from_state(const std::string& state);

template <int Rows, int Cols>
Json matrix_to_json(const Eigen::Matrix<double, Rows, Cols>& m) {
  return std::vector<double>(m.data(), m.data() + m.size());
}
template <int Rows, int Cols>
Eigen::Matrix<double, Rows, Cols> matrix_from_json(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  if (values.size() != static_cast<std::size_t>(Rows * Cols)) {
    throw std::invalid_argument("state: a matrix has the wrong number of elements");
  }
  return Eigen::Map<const Eigen::Matrix<double, Rows, Cols>>(values.data());
}

void to_json(Json& json, const Detection& detection);
void from_json(const Json& json, Detection& detection);
void to_json(Json& json, const FieldOfView& view);
void from_json(const Json& json, FieldOfView& view);
void to_json(Json& json, const LandmarkScan& scan);
void from_json(const Json& json, LandmarkScan& scan);
void to_json(Json& json, const Preintegration& p);
void from_json(const Json& json, Preintegration& p);
void to_json(Json& json, const Odometry& odometry);
void from_json(const Json& json, Odometry& odometry);
void to_json(Json& json, const LevelCorrection& level);
void from_json(const Json& json, LevelCorrection& level);
void to_json(Json& json, const OdometryBuffer& buffer);
/// Into an empty buffer.
void from_json(const Json& json, OdometryBuffer& buffer);

template <typename T>
Json optional_to_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}
template <typename T>
std::optional<T> optional_from_json(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return json.get<T>();
}

}  // namespace understory::model
