// Existence of one landmark, and its encoding.
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

/// Before the time of any drive [us].
inline constexpr model::Utime kNever = std::numeric_limits<model::Utime>::min() / 2;

/// A landmark of the map.
struct TrackedPoint {
  Point point;
  model::Utime looked_utime = 0;  ///< Of the keyframe that last looked at it.
  bool is_in_use = true;
  double told_probability = -1.0;          ///< As last published; -1: never.
  bool was_told_in_use = true;             ///< Likewise.
  bool state_is_due = true;                ///< It changed since its state was published.
  bool is_first_pass = false;              ///< Only the pass that found it has looked.
  bool is_confirmed = true;                ///< A later pass than its first one saw it.
  double looked_m = -1e9;                  ///< Path of the drive at the last look.
  double pass_began_m = -1e9;              ///< Likewise at the first look of its pass.
  model::Utime pass_began_utime = kNever;  ///< Of that look.
  bool is_counted = false;                 ///< Counted as a false birth.
  bool has_just_left = false;              ///< It left use in the current pass.
  double judged_by = 0.0;           ///< v of the earlier drives that P is based on; 0: no estimate.
  std::uint64_t judged_times = 0;   ///< Number of the estimate that P is based on.
  bool is_among_histories = false;  ///< Its history is counted in its present form.
};

/// Counts of new landmarks that a later pass confirmed or not.
struct BirthCounts {
  double confirmed = 0.0;
  double false_ones = 0.0;

  /// Share of the confirmed ones; without any, `expected`.
  double share(double expected) const {
    constexpr double kWeight = 10.0;
    return (confirmed + kWeight * expected) / (confirmed + false_ones + kWeight);
  }
};

/// Bytes of a point's state: the same for each.
std::size_t point_bytes();
/// State of a point as plain numbers, little endian; equal points give equal bytes.
std::string encode(const TrackedPoint& tracked);
/// Decodes a state in a later drive. Throws std::invalid_argument on other bytes.
TrackedPoint decode(const existence::ExistenceModel& model, std::string_view bytes, bool is_in_use);

/// The estimates about detector and world, likewise.
std::string encode(const existence::ExistenceModel& model, const BirthCounts& births);
/// Throws std::invalid_argument; both are then unchanged.
void decode(std::string_view bytes, existence::ExistenceModel& model, BirthCounts& births);

}  // namespace understory::existence_tracker
