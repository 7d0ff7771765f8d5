#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/io/text_file.hpp"
#include "common/io/victoria_park.hpp"
#include "common/model/stem_frame.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/loop_detectors/frame_set.hpp"
#include "eval/experiments/victoria_park/victoria_park.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "sim/forest.hpp"
#include "sim/stem_frames.hpp"

namespace understory::eval::experiments::loop_detectors {
namespace {

namespace places = understory::place_recognition;

/// Thinner stems of a census are left out, as no laser finds them.
constexpr double kLeastDiameterM = 0.08;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',') cells.emplace_back();
    if (c != ',' && c != '\r') cells.back() += c;
  }
  return cells;
}

/// The table with `column` [cm] as dbh_m, rows without it left out.
std::string with_diameters(const std::string& text, std::string_view column) {
  std::string table = "x_m,y_m,dbh_m\n";
  std::vector<std::string> heading;
  std::string line;
  for (const char c : text) {
    if (c != '\n') {
      line += c;
      continue;
    }
    const std::vector<std::string> cells = cells_of(line);
    line.clear();
    if (heading.empty()) {
      heading = cells;
      continue;
    }
    const auto at = [&](std::string_view name) {
      return static_cast<std::size_t>(std::find(heading.begin(), heading.end(), name) -
                                      heading.begin());
    };
    if (std::max({at("x_m"), at("y_m"), at(column)}) >= cells.size() || cells[at(column)].empty())
      continue;
    const double diameter_m = 0.01 * std::stod(cells[at(column)]);
    if (diameter_m >= kLeastDiameterM)
      table += fmt::format("{},{},{}\n", cells[at("x_m")], cells[at("y_m")], diameter_m);
  }
  return table;
}

sim::Forest read_forest(const std::filesystem::path& file, std::string_view diameter_cm) {
  const std::string text = io::read_whole_file(file.string());
  const sim::StemMapResult read =
      sim::parse_stem_map(diameter_cm.empty() ? text : with_diameters(text, diameter_cm));
  if (!read.error.empty())
    throw std::runtime_error(fmt::format("{}: {}", file.string(), read.error));
  return read.forest;
}

/// Stems levelled in space.
FrameSet levelled_set(std::string name, const std::vector<model::StemFrame>& frames) {
  FrameSet set;
  set.name = std::move(name);
  for (const model::StemFrame& frame : frames) {
    places::PlaceFrame place;
    place.id = static_cast<places::FrameId>(set.frames.size());
    const Eigen::Matrix3d level = model::level_R_sensor(frame);
    for (const model::Stem& stem : frame.stems)
      place.landmarks.push_back({level * stem.position_m, stem.diameter_m});
    set.frames.push_back(std::move(place));
    set.world_T_level.push_back(model::level_pose(frame));
  }
  return set;
}

places::PlaceFrame laser_frame(const model::PlanarScan& scan,
                               landmark_extractor::LandmarkExtractor& extractor) {
  places::PlaceFrame frame;
  for (const model::Detection& found : extractor.extract(scan).detections)
    frame.landmarks.push_back({found.position_m, 2.0 * found.radius_m});
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (!scan.is_return(beam)) continue;
    const double angle = scan.bearing(beam);
    const double range = static_cast<double>(scan.ranges_m[beam]);
    frame.cloud.emplace_back(
        Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0.0).cast<float>());
  }
  return frame;
}

}  // namespace

FrameSet stem_map_set(const std::filesystem::path& file, std::string_view diameter_cm,
                      const SetOptions& options) {
  const sim::Forest forest = read_forest(file, diameter_cm);
  const sim::Route way =
      sim::make_stem_way(sim::StemWay::kWander, forest, options.length_m, options.seed);
  return levelled_set(
      file.stem().string(),
      sim::drive_stem_frames(forest, way, sim::StemDriveParameters{}, options.seed));
}

FrameSet kitti_poles_set(const std::filesystem::path& folder, const SetOptions& options) {
  const sim::Forest poles = read_forest(folder / "seq00_poles.csv", {});
  const std::vector<Eigen::Vector2d> recorded = read_forest(folder / "seq00_traj.csv", {}).trunks_m;
  std::vector<Eigen::Vector2d> way{recorded.front()};
  for (const Eigen::Vector2d& place : recorded) {
    if ((place - way.back()).norm() > 0.7) way.push_back(place);
  }
  sim::StemDriveParameters drive;
  drive.detector.range_m = 40.0;
  drive.speed_mps = 8.0;
  return levelled_set("kitti-00-poles", sim::drive_stem_frames(poles, sim::Route::through(way, 3.0),
                                                               drive, options.seed));
}

FrameSet victoria_park_set(const std::filesystem::path& recording, const std::atomic<bool>& stop) {
  constexpr double kSpacingM = 2.0;
  const io::VictoriaPark park = io::read_victoria_park(recording);
  const auto config = victoria_park::victoria_park_defaults();
  const auto run = victoria_park::drive_victoria_park(park, config, [&] {
    if (stop) throw terminal::Interrupted();
  });

  FrameSet set;
  set.name = "victoria-park";
  set.has_clouds = true;
  landmark_extractor::LandmarkExtractor extractor(config.extractor);
  for (const model::PlanarScan& scan : park.scans) {
    const auto pose = metrics::pose_at(run.trajectory, scan.utime);
    if (!pose) continue;
    const bool has_moved =
        set.world_T_level.empty() ||
        (set.world_T_level.back().translation() - pose->translation()).norm() >= kSpacingM;
    if (!has_moved) continue;
    set.frames.push_back(laser_frame(scan, extractor));
    set.frames.back().id = static_cast<places::FrameId>(set.frames.size() - 1);
    set.world_T_level.push_back(*pose);
  }
  return set;
}

}  // namespace understory::eval::experiments::loop_detectors
