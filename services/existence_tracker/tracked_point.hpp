// One landmark's existence, and its bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"
#include "common/model/map.hpp"

namespace understory::existence_tracker {

/// The model's point with the shell that the tracker uses.
using Point = existence::PointExistence<existence::IcosahedralShell>;

/// A landmark of the map.
struct TrackedPoint {
  Point point;
  model::Utime looked_utime = 0;  ///< Of the keyframe that last looked at it.
  bool is_in_use = true;
  double told_probability = -1.0;  ///< As it was last told; -1: never.
  bool was_told_in_use = true;     ///< Likewise.
  bool state_is_due = true;        ///< It changed since its state was told.
};

/// Bytes of a point's state: the same for each.
std::size_t point_bytes();
/// State of a point as plain numbers, little endian: of the same point the same bytes.
std::string encode(const Point& point, model::Utime looked_utime);
/// The point of a state. Throws std::invalid_argument where the bytes are none.
TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes, bool is_in_use);

/// What was learned of detector and world, likewise.
std::string encode(const existence::ExistenceModel& model);
/// Throws std::invalid_argument; the model is then as it was.
void decode(std::string_view bytes, existence::ExistenceModel& model);

}  // namespace understory::existence_tracker
