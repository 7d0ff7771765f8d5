#include "eval/experiments/one_shot/trials.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>

#include "common/io/text_file.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::one_shot {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

std::size_t column_of(const std::vector<std::string>& header, std::string_view name) {
  const auto it = std::find(header.begin(), header.end(), name);
  if (it == header.end()) throw std::runtime_error("no column " + std::string(name));
  return static_cast<std::size_t>(it - header.begin());
}

double number(const std::vector<std::string>& cells, std::size_t column) {
  if (column >= cells.size() || cells[column].empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return std::strtod(cells[column].c_str(), nullptr);
}

/// Uniform in the bounds of the stems.
geometry::SE2 pose_in(const StemMap& map, std::mt19937_64& random) {
  Eigen::Vector2d low = map.stems_m.front();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& stem : map.stems_m) {
    low = low.cwiseMin(stem);
    high = high.cwiseMax(stem);
  }
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double x = low.x() + (high.x() - low.x()) * unit(random);
  const double y = low.y() + (high.y() - low.y()) * unit(random);
  return {x, y, 2.0 * std::numbers::pi * (unit(random) - 0.5)};
}

}  // namespace

StemMap make_stem_map(std::string name, std::string_view csv, std::string_view diameter,
                      double least_diameter) {
  StemMap result;
  result.name = std::move(name);
  std::stringstream lines{std::string(csv)};
  std::string line;
  std::getline(lines, line);
  const auto header = cells_of(line);
  const std::size_t x = column_of(header, "x_m");
  const std::size_t y = column_of(header, "y_m");
  const std::size_t d = diameter.empty() ? 0 : column_of(header, diameter);
  while (std::getline(lines, line)) {
    const auto cells = cells_of(line);
    if (!diameter.empty() && !(number(cells, d) >= least_diameter)) continue;
    const Eigen::Vector2d stem(number(cells, x), number(cells, y));
    if (!stem.allFinite()) continue;
    result.stems_m.push_back(stem);
    result.map.insert(result.stems_m.size(), stem);
  }
  if (result.stems_m.empty()) throw std::runtime_error("no stems");
  return result;
}

StemMap load_map(const MapSource& source, const std::filesystem::path& data) {
  const std::filesystem::path file = data / source.file;
  const std::string text = io::read_whole_file(file);
  try {
    return make_stem_map(source.name, text, source.diameter, source.least_diameter);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

Scan make_scan(const StemMap& map, const ScanSetting& setting, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, setting.sigma_m);
  Scan scan;
  scan.map_T_sensor = pose_in(map, random);
  const geometry::SE2 sensor_T_map = scan.map_T_sensor.inverse();

  std::vector<std::pair<constellation::ObservedPoint, std::uint64_t>> seen;
  for (const auto id : map.map.near({scan.map_T_sensor.translation(), setting.range_m})) {
    if (unit(random) > setting.detection) continue;
    const Eigen::Vector2d stem = sensor_T_map * map.stems_m[id - 1];
    const double dx = noise(random);
    const double dy = noise(random);
    seen.push_back({{stem + Eigen::Vector2d(dx, dy), setting.sigma_m}, id});
  }

  const auto clutter = std::lround(static_cast<double>(seen.size()) * setting.false_share /
                                   (1.0 - setting.false_share));
  for (std::int64_t i = 0; i < clutter; ++i) {
    const double radius = setting.range_m * std::sqrt(unit(random));
    const double angle = 2.0 * std::numbers::pi * unit(random);
    const Eigen::Vector2d point(radius * std::cos(angle), radius * std::sin(angle));
    seen.push_back({{point, setting.sigma_m}, std::uint64_t{0}});
  }

  std::shuffle(seen.begin(), seen.end(), random);
  for (const auto& [point, id] : seen) {
    scan.points.push_back(point);
    scan.truth.push_back(id);
  }
  return scan;
}

Trial run_trial(const StemMap& map, const ScanSetting& setting, std::uint64_t seed,
                const constellation::LocaliseParameters& parameters) {
  const Scan scan = make_scan(map, setting, seed);
  const double start = tools::thread_time_s();
  const constellation::Localisation answer = map.map.localise(scan.points, parameters);
  Trial trial;
  trial.ms = 1e3 * (tools::thread_time_s() - start);
  trial.outcome = answer.outcome;
  trial.points = static_cast<int>(scan.points.size());
  trial.stems_in_scan = trial.points - static_cast<int>(std::count(
                                           scan.truth.begin(), scan.truth.end(), std::uint64_t{0}));
  trial.hypotheses = answer.hypotheses;
  trial.work = answer.lookups;
  trial.inliers = static_cast<int>(answer.inliers);
  for (const auto& pair : answer.associations) {
    trial.wrong_pairs += scan.truth[pair.observed] != pair.landmark_id ? 1 : 0;
  }
  if (answer.inliers == 0) return trial;

  const Eigen::Vector3d error = (answer.map_T_sensor.inverse() * scan.map_T_sensor).Log();
  trial.error_m = (answer.map_T_sensor.translation() - scan.map_T_sensor.translation()).norm();
  trial.error_rad = std::abs(error.z());
  trial.nees = error.dot(answer.covariance.ldlt().solve(error));
  const Eigen::Matrix2d position = answer.covariance.topLeftCorner<2, 2>();
  trial.stated_m =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position, Eigen::EigenvaluesOnly)
                    .eigenvalues()
                    .y());
  return trial;
}

std::uint64_t trial_seed(std::uint64_t seed, std::uint64_t cell, std::uint64_t trial) {
  // SplitMix64: neighbouring numbers give unrelated ones.
  std::uint64_t mixed = seed * 0x9E3779B97F4A7C15ULL + (cell << 32) + trial;
  mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9ULL;
  mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EBULL;
  return mixed ^ (mixed >> 31);
}

}  // namespace understory::eval::experiments::one_shot
