// Checks and copies common to several conversions.
#pragma once

#include <cstdint>
#include <limits>
#include <numbers>

#include "common/model/landmarks.hpp"
#include "common/wire/checks.hpp"
#include "understory/pose2_t.hpp"

namespace understory::wire {

/// Largest absolute coordinate of a landmark.
inline constexpr double kFarthestPositionM = 1e7;
/// Largest radius of a landmark.
inline constexpr double kLargestRadiusM = 100.0;
/// Longest range of a field of view.
inline constexpr double kLongestRangeM = 1e6;
/// Largest component of a velocity.
inline constexpr double kFastestMps = 1000.0;

/// Largest index of a detection in its scan.
inline constexpr double kMostDetections = 1e9;
/// Largest id of a map: positive in the 16 bits for the map in a landmark's id.
inline constexpr double kMostMaps = 0x7fff;

/// Stamp and number of a message.
template <class Wire, class Value>
void take_stamp(const Wire& wire, Value& value) {
  value.utime = wire.utime;
  value.sequence = static_cast<std::uint64_t>(wire.seq);
}
/// The opposite.
template <class Value, class Wire>
void put_stamp(const Value& value, Wire& wire) {
  wire.utime = value.utime;
  wire.seq = static_cast<std::int64_t>(value.sequence);
}

/// Into the rows of a wire type.
template <int N>
void copy_matrix(const Eigen::Matrix<double, N, N>& matrix, SquareArray<N>& rows) {
  for (int row = 0; row < N; ++row) {
    for (int column = 0; column < N; ++column) rows[row][column] = matrix(row, column);
  }
}

/// Copies into an array of at least the vector's size.
template <class Vector>
void copy_vector(const Vector& vector, double* out) {
  for (Eigen::Index i = 0; i < vector.size(); ++i) out[i] = vector[i];
}

/// Checks position, radius and kind, common to all landmark types.
template <class Wire>
void check_landmark(const Wire& wire, Checks& checks) {
  for (const double coordinate : wire.position_m) {
    checks.range("position_m", coordinate, -kFarthestPositionM, kFarthestPositionM);
  }
  checks.range("radius_m", wire.radius_m, 0.0, kLargestRadiusM);
  checks.range("kind", wire.kind, 0, 1);
}

/// Checks and converts the three fields of the field of view.
template <class Wire>
model::FieldOfView field_of_view(const Wire& wire, Checks& checks) {
  constexpr double kFullCircle = 2.0 * std::numbers::pi;
  checks.range("max_range_m", wire.max_range_m, 0.0, kLongestRangeM);
  checks.range("bearing_rad", wire.bearing_rad, -kFullCircle, kFullCircle);
  checks.range("width_rad", wire.width_rad, 0.0, kFullCircle + 1e-9);
  return {wire.max_range_m, wire.bearing_rad, wire.width_rad};
}

/// The opposite of field_of_view().
template <class Wire>
void copy_field_of_view(const model::FieldOfView& from, Wire& wire) {
  wire.max_range_m = from.max_range_m;
  wire.bearing_rad = from.bearing_rad;
  wire.width_rad = from.width_rad;
}

}  // namespace understory::wire
