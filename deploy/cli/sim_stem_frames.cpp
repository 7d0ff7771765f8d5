#include "deploy/cli/sim_stem_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/io/stem_frames.hpp"
#include "common/io/text_file.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/shared_error_options.hpp"
#include "sim/stem_frames.hpp"

namespace understory::cli {
namespace {

struct StemSimulationOptions {
  std::string map;
  std::string dbh_cm;
  std::string out;
  std::string path = "laps";
  double length_m = 1000.0;
  sim::StemDriveParameters drive;
  std::uint64_t seed = 1;
};

std::vector<std::string> split_by_comma(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

/// Converts a census with diameters in cm under another name to a table with dbh_m; rows without a
/// diameter are left out.
std::string with_diameters_in_m(const std::string& text, const StemSimulationOptions& options) {
  std::stringstream lines(text);
  std::string line;
  std::getline(lines, line);
  const auto names = split_by_comma(line);
  const auto column = [&](const std::string& name) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) fail(fmt::format("{}: no column {}", options.map, name));
    return static_cast<std::size_t>(found - names.begin());
  };
  const std::size_t x = column("x_m"), y = column("y_m"), dbh = column(options.dbh_cm);

  std::string table = "x_m,y_m,dbh_m\n";
  for (int number = 2; std::getline(lines, line); ++number) {
    const auto cells = split_by_comma(line);
    if (cells.size() <= dbh || cells[dbh].empty()) continue;
    double cm = 0.0;
    const char* const end = cells[dbh].data() + cells[dbh].size();
    const auto read = std::from_chars(cells[dbh].data(), end, cm);
    if (read.ec != std::errc{} || read.ptr != end || cells.size() <= std::max(x, y))
      fail(fmt::format("{}, line {}: {} '{}' is no number", options.map, number, options.dbh_cm,
                       cells[dbh].substr(0, 40)));
    table += fmt::format("{},{},{}\n", cells[x], cells[y], 0.01 * cm);
  }
  return table;
}

sim::Forest stem_map_of(const StemSimulationOptions& options) {
  const std::string text = io::read_whole_file(options.map);
  sim::StemMapResult result =
      sim::parse_stem_map(options.dbh_cm.empty() ? text : with_diameters_in_m(text, options));
  if (!result.error.empty()) fail(fmt::format("{}: {}", options.map, result.error));
  return std::move(result.forest);
}

/// Reads a path from a table with x_m and y_m, or from a TUM trajectory.
std::vector<Eigen::Vector2d> recorded_way(const std::string& file) {
  const std::string text = io::read_whole_file(file);
  if (file.ends_with(".csv")) {
    sim::StemMapResult table = sim::parse_stem_map(text);
    if (!table.error.empty()) fail(fmt::format("{}: {}", file, table.error));
    return std::move(table.forest.trunks_m);
  }

  const auto poses = io::parse_stem_trajectory(text, file);
  std::vector<Eigen::Vector2d> points;
  points.reserve(poses.size());
  for (const model::StemFrame& pose : poses)
    points.emplace_back(pose.world_T_sensor.translation().head<2>());
  return points;
}

sim::Route way_of(const StemSimulationOptions& options, const sim::Forest& forest) {
  if (const auto kind = sim::stem_way(options.path))
    return sim::make_stem_way(*kind, forest, options.length_m, options.seed);
  return sim::fit_stem_way(recorded_way(options.path), forest);
}

void simulate_stem_frames(const StemSimulationOptions& options) {
  try {
    const sim::Forest forest = stem_map_of(options);
    const sim::Route way = way_of(options, forest);
    const auto frames = sim::drive_stem_frames(forest, way, options.drive, options.seed);
    io::write_stem_frames(options.out, frames);
    std::size_t stems = 0;
    for (const model::StemFrame& frame : frames) stems += frame.stems.size();
    fmt::print("{} frames, {:.1f} stems in each, {:.0f} m -> {}\n", frames.size(),
               static_cast<double>(stems) / static_cast<double>(frames.size()), way.length_m(),
               options.out);
  } catch (const io::DataError& error) {
    fail(error.what());
  } catch (const std::runtime_error& error) {
    if (dynamic_cast<const CLI::Error*>(&error) != nullptr) throw;
    fail(fmt::format("sim stem-frames {}: {}", options.map, error.what()));
  }
}

void add_detector_options(CLI::App& command, sim::StemDetectorParameters& detector) {
  const auto add = [&](const char* name, double& value, const char* text, double low, double high) {
    command.add_option(name, value, text)->check(CLI::Range(low, high))->capture_default_str();
  };
  add("--range", detector.range_m, "Range of the detector [m]", 2.0, 200.0);
  add("--seen", detector.seen_share, "Share of the stems that a visit detects", 0.0, 1.0);
  add("--detection", detector.detection, "Share of these stems that each frame detects", 0.0, 1.0);
  add("--false-stems", detector.false_per_frame, "Mean number of false stems per frame", 0.0, 1e3);
  add("--noise", detector.position_sigma_m,
      "Independent standard deviation of a position per axis [m]", 0.0, 5.0);
  add("--diameter-noise", detector.diameter_sigma_share,
      "Standard deviation of a diameter, as a share of it", 0.0, 1.0);
  add("--tilt", detector.tilt_sigma_rad, "Standard deviation of roll and of pitch [rad]", 0.0, 0.5);
  add_view_option(command, detector.view_rad);
  add("--least-diameter", detector.least_diameter_m, "Thinner stems are not detected [m]", 0.0,
      5.0);
}

}  // namespace

void add_stem_frames_simulation(CLI::App& sim) {
  auto* command = sim.add_subcommand(
      "stem-frames", "A drive through a surveyed forest as a folder of detected stems");
  auto options = std::make_shared<StemSimulationOptions>();
  command->add_option("map", options->map, "CSV file with x_m,y_m[,dbh_m]")->required();
  command->add_option(
      "--dbh-cm", options->dbh_cm,
      "Column with diameters in cm, if there is no dbh_m; rows without a diameter are left out");
  command->add_option("--out", options->out, "The folder to write")->required();
  command
      ->add_option(
          "--path", options->path,
          fmt::format(
              "{}, or a recorded path (CSV with x_m,y_m, or TUM), scaled down to fit the map",
              fmt::join(sim::stem_way_names(), ", ")))
      ->capture_default_str();
  command
      ->add_option("--length", options->length_m,
                   "Length of the path, if it is not a recorded one [m]")
      ->check(CLI::Range(20.0, 1e5))
      ->capture_default_str();

  sim::StemDriveParameters& drive = options->drive;
  command->add_option("--spacing", drive.spacing_m, "Path length between frames [m]")
      ->check(CLI::Range(0.05, 100.0))
      ->capture_default_str();
  command->add_option("--speed", drive.speed_mps, "Speed [m/s]")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  command
      ->add_option("--visit-gap-s", drive.visit_gap_s,
                   "Time out of range after which a stem counts as a new visit [s]")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--visit", drive.visit,
                   "Number of the visit; another number is the same drive on another day")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  command
      ->add_option("--truth-offset", drive.truth_offset_m,
                   "Offset of the trajectory's frame, in x and in y [m]")
      ->check(CLI::Range(-1e6, 1e6))
      ->capture_default_str();
  command
      ->add_option("--stems-in-view", drive.stems_in_view,
                   "Thin the forest to this mean number of stems in view; 0 = do not thin it")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  add_detector_options(*command, drive.detector);
  add_shared_error_options(*command, drive.detector.shared);
  command->add_option("--seed", options->seed, "Seed of path, detector and noise")
      ->capture_default_str();
  command->callback([options] { simulate_stem_frames(*options); });
}

}  // namespace understory::cli
