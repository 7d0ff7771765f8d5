// One-shot localisation in surveyed stem maps: single scans, each located in its whole map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/constellation/map.hpp"

namespace understory::eval::experiments::one_shot {

/// The stems of a surveyed map.
struct StemMap {
  std::string name;
  std::vector<Eigen::Vector2d> stems_m;
  constellation::ConstellationMap map;  ///< Ids are the stems' indices + 1.
};

/// The map in a CSV text with a header that names the columns x_m and y_m. Where `diameter` is not
/// empty, only stems whose column of that name holds a number of at least `least_diameter`.
/// Throws std::runtime_error where a column is missing.
StemMap make_stem_map(std::string name, std::string_view csv, std::string_view diameter = {},
                      double least_diameter = 0.0);

/// Where a surveyed map is, below the folder of recordings.
struct MapSource {
  const char* name;
  const char* file;
  const char* diameter = "";  ///< See make_stem_map().
  double least_diameter = 0.0;
};
/// The map of a source. Throws std::runtime_error naming the file.
StemMap load_map(const MapSource& source, const std::filesystem::path& data);

/// How a scan is made.
struct ScanSetting {
  double range_m = 40.0;
  double sigma_m = 0.2;  ///< Of a detection, per axis; stated as it is.
  double detection = 0.9;
  double false_share = 0.0;  ///< Of all points of a scan: uniform in the range.
};

/// One scan and the answer to it.
struct Trial {
  constellation::LocaliseOutcome outcome = constellation::LocaliseOutcome::kNoMatch;
  int points = 0;
  int stems_in_scan = 0;  ///< True ones among the points.
  int inliers = 0;
  int wrong_pairs = 0;
  std::uint32_t hypotheses = 0;
  std::uint32_t work = 0;  ///< Hypotheses and fits, in hypotheses.
  double error_m = 0.0;    ///< Of the position, where a pose was given.
  double error_rad = 0.0;
  double stated_m = 0.0;  ///< Square root of the larger eigenvalue of the position's covariance.
  double nees = 0.0;      ///< 3 degrees of freedom.
  double ms = 0.0;        ///< Processor time.
  bool found() const { return outcome == constellation::LocaliseOutcome::kFound; }
};

/// A scan and what it was made from.
struct Scan {
  geometry::SE2 map_T_sensor;
  std::vector<constellation::ObservedPoint> points;
  std::vector<std::uint64_t> truth;  ///< Id of each point's stem; 0 = false point.
};

/// A scan from a place within the bounds of the map; the same seed gives the same scan.
Scan make_scan(const StemMap& map, const ScanSetting& setting, std::uint64_t seed);

/// That scan located in its map.
Trial run_trial(const StemMap& map, const ScanSetting& setting, std::uint64_t seed,
                const constellation::LocaliseParameters& parameters);

/// A seed for each trial of each cell of a campaign.
std::uint64_t trial_seed(std::uint64_t seed, std::uint64_t cell, std::uint64_t trial);

}  // namespace understory::eval::experiments::one_shot
