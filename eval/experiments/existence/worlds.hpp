// Point worlds: drives through points, walls and vans, of which some change.
#pragma once

#include <cstdint>

#include "eval/experiments/existence/looks.hpp"

namespace understory::eval::experiments::existence {

/// How a world is and how it changes.
struct WorldSetting {
  int points = 400;
  double side_m = 90.0;
  double changed = 0.2;  ///< Share of the points that go after the mapping drives.
  double pass_missed =
      0.05;  ///< Share of points that a drive cannot see, drawn per point and drive.
  double recall_near = 0.9;  ///< Of a look, falling linearly to recall_far at the range.
  double recall_far = 0.6;
  double false_rate = 0.01;
  double range_m = 30.0;
  double scan_every_m = 1.5;
  int walls = 6;  ///< Stand from the beginning.
  int vans = 8;   ///< Parked anew at each drive after the change.
  int changed_drives = 3;
  double gap_days = 30.0;   ///< From the mapping drives to the others.
  bool has_ranges = false;  ///< The sensor measures along the rays (LIDAR).
};

/// Two mapping drives a day apart; `gap_days` later the changed world, driven through a day apart.
History make_history(const WorldSetting& setting, std::uint64_t seed);

/// The sensor stands for an hour, a look a second, beside a van that hides 20 of 40 points; mapped
/// before from all sides.
History make_occlusion_trap(const WorldSetting& setting, std::uint64_t seed);

/// 50 neighbours felled, 20 beside them hidden by a lorry from one long side: one pass along it.
History make_clear_cut(const WorldSetting& setting, std::uint64_t seed);

}  // namespace understory::eval::experiments::existence
