// One landmark's existence, and its bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"
#include "common/model/map.hpp"

namespace understory::existence_tracker {

/// The model's point with the shell that the tracker uses.
using Point = existence::PointExistence<existence::IcosahedralShell>;

/// Before any time that a drive has [us].
inline constexpr model::Utime kNever = std::numeric_limits<model::Utime>::min() / 2;

/// A landmark of the map.
struct TrackedPoint {
  Point point;
  model::Utime looked_utime = 0;  ///< Of the keyframe that last looked at it.
  bool is_in_use = true;
  double told_probability = -1.0;          ///< As it was last told; -1: never.
  bool was_told_in_use = true;             ///< Likewise.
  bool state_is_due = true;                ///< It changed since its state was told.
  bool is_first_pass = false;              ///< Nobody but the pass that found it has looked.
  bool is_confirmed = true;                ///< Another pass than the one that found it saw it.
  double looked_m = -1e9;                  ///< Path of the drive at the last look.
  double pass_began_m = -1e9;              ///< Likewise at the first look of its pass.
  model::Utime pass_began_utime = kNever;  ///< Of that look.
  bool is_counted = false;                 ///< Among the births that were false.
  bool has_just_left = false;              ///< It left use in the pass that is open.
  double judged_by = 0.0;           ///< v of the drives before that P follows; 0: none was learned.
  std::uint64_t judged_times = 0;   ///< Number of the rates that P follows.
  bool is_among_histories = false;  ///< What became of it is counted as it is now.
};

/// How many of the landmarks that were new turned out to be there when another pass came.
struct BirthCounts {
  double confirmed = 0.0;
  double false_ones = 0.0;

  /// Share of those that are confirmed; before any came, that of `expected`.
  double share(double expected) const {
    constexpr double kWeight = 10.0;
    return (confirmed + kWeight * expected) / (confirmed + false_ones + kWeight);
  }
};

/// Bytes of a point's state: the same for each.
std::size_t point_bytes();
/// State of a point as plain numbers, little endian: of the same point the same bytes.
std::string encode(const TrackedPoint& tracked);
/// The point of a state, of a later drive. Throws std::invalid_argument where the bytes are none.
TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes, bool is_in_use);

/// What was learned of detector and world, likewise.
std::string encode(const existence::ExistenceModel& model, const BirthCounts& births);
/// Throws std::invalid_argument; both are then as they were.
void decode(std::string_view bytes, existence::ExistenceModel& model, BirthCounts& births);

}  // namespace understory::existence_tracker
