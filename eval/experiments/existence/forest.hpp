// A real forest at two dates, and the real mortality of trees.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/existence/decay_rate.hpp"
#include "eval/experiments/existence/looks.hpp"

namespace understory::eval::experiments::existence {

/// A stem above 10 cm at one of the censuses.
struct CensusStem {
  Eigen::Vector2f place_m;
  float radius_m = 0.0F;
  bool is_gone = false;  ///< Not in the second census.
  bool is_new = false;   ///< Above 10 cm in the second census alone.

  bool stands(bool is_later) const { return is_later ? !is_gone : !is_new; }
};

/// Stems of the first census in a CSV text with x_m, y_m, dbh_2008_cm, dbh_2014_cm. Throws
/// std::runtime_error where a column is missing.
std::vector<CensusStem> read_census(std::string_view csv);
/// The same, and those that are new in the second one.
std::vector<CensusStem> read_both_censuses(std::string_view csv);

/// How the forest is driven through.
struct ForestSetting {
  double pass_missed = 0.36;  ///< Share of stems that a drive cannot see, drawn per stem and drive.
  double recall_near = 0.9;
  double recall_far = 0.6;
  double false_rate = 0.01;
  double range_m = 15.0;
  double lane_m = 16.0;  ///< Between the lanes of a drive; each drive's begin elsewhere.
  double scan_every_m = 2.0;
  int drives = 5;          ///< After the change.
  bool is_changed = true;  ///< False: the control, the same forest at all drives.
};

/// One drive at the first census, then others six years later, a day apart. Stems hide each other;
/// the sensor measures ranges, so what is blocked is known to be.
History drive_forest(const std::vector<CensusStem>& stems, const ForestSetting& setting,
                     std::uint64_t seed);

/// Trees surveyed again and again.
struct Mortality {
  understory::existence::DecayRate rate{1e-9, 1.0};
  std::size_t trees = 0;
  std::size_t died = 0;
  double tree_years = 0.0;  ///< Alive, the last interval of who died by half.
};
/// Intervals between censuses of each tree from its first "alive" on, in a CSV text with columns
/// c1_date, c1_status ... Throws std::runtime_error where a column is missing.
Mortality read_mortality(std::string_view csv);

/// A file's text. Throws std::runtime_error naming it.
std::string read_text(const std::filesystem::path& file);

}  // namespace understory::eval::experiments::existence
