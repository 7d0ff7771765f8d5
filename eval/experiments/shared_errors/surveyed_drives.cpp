#include "eval/experiments/shared_errors/surveyed_drives.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/io/text_file.hpp"
#include "eval/experiments/existence/csv.hpp"

namespace understory::eval::experiments::shared_errors {
namespace {

const std::array<std::string, 6> kUsual{"longleaf-laps",    "lansing-wander",   "lansing-34",
                                        "bigwoods-kitti00", "bigwoods-kitti02", "bei-kitti00"};
constexpr const char* kBigWoods = "stem_censuses/big_woods.csv";
constexpr const char* kKitti00 = "pole_maps/seq00_traj.csv";
constexpr const char* kKitti02 = "pole_maps/seq02_traj.csv";

/// A table with diameters in metres, of the rows that have one.
std::string with_diameters_in_metres(std::string_view csv, std::string_view column) {
  existence::CsvRows rows(csv);
  const std::size_t x = rows.column("x_m"), y = rows.column("y_m"), dbh = rows.column(column);
  std::string table = "x_m,y_m,dbh_m\n";
  while (rows.next()) {
    const auto diameter_cm = rows.number(dbh);
    if (diameter_cm)
      table += fmt::format("{},{},{}\n", rows.text(x), rows.text(y), 0.01 * *diameter_cm);
  }
  return table;
}

sim::Forest read_stems(const std::filesystem::path& file, const std::string& diameter_cm) {
  std::string text = io::read_whole_file(file.string());
  if (!diameter_cm.empty()) text = with_diameters_in_metres(text, diameter_cm);
  sim::StemMapResult read = sim::parse_stem_map(text);
  if (!read.error.empty())
    throw std::runtime_error(fmt::format("{}: {}", file.string(), read.error));
  return std::move(read.forest);
}

}  // namespace

std::span<const std::string> usual_drives() { return kUsual; }

std::vector<SurveyedDrive> surveyed_drives() {
  const std::string longleaf = "tree_maps/longleaf.csv", lansing = "tree_maps/lansing.csv";
  std::vector<SurveyedDrive> drives{{kUsual[0], longleaf, "", "laps", 1600.0, {}},
                                    {kUsual[1], lansing, "", "wander", 2500.0, {}},
                                    {kUsual[2], lansing, "", "laps", 1800.0, {}},
                                    {kUsual[3], kBigWoods, "dbh_2014_cm", kKitti00, 0.0, {}},
                                    {kUsual[4], kBigWoods, "dbh_2014_cm", kKitti02, 0.0, {}},
                                    {kUsual[5], "tree_maps/bei.csv", "", kKitti00, 0.0, {}},
                                    {"longleaf-few", longleaf, "", "laps", 1600.0, {}}};

  drives[2].drive.detector.seen_share = 0.34;
  drives[3].drive.detector.least_diameter_m = 0.12;
  drives[3].drive.detector.seen_share = 0.5;
  drives[3].drive.detector.range_m = 15.0;
  drives[3].drive.spacing_m = 4.0;
  drives[4].drive.detector.least_diameter_m = 0.12;
  drives[4].drive.detector.range_m = 18.0;

  // A laser with one plane that looks ahead.
  drives[6].drive.detector.view_rad = std::numbers::pi;
  drives[6].drive.detector.range_m = 20.0;
  drives[6].drive.detector.seen_share = 1.0;
  drives[6].drive.detector.false_per_frame = 0.1;
  drives[6].drive.stems_in_view = 2.8;
  return drives;
}

std::optional<StemErrors> stem_errors(std::string_view name) {
  if (name == "shared") return StemErrors{true, true, true};
  if (name == "along") return StemErrors{true, false, false};
  if (name == "direction") return StemErrors{false, true, false};
  if (name == "range") return StemErrors{false, false, true};
  if (name == "independent") return StemErrors{};
  return std::nullopt;
}

sim::StemDetectorParameters with_errors(sim::StemDetectorParameters detector, StemErrors errors) {
  const sim::SharedErrorParameters measured = sim::measured_shared_errors();
  detector.shared = measured;
  if (!errors.along) detector.shared.along_sigma_m = 0.0;
  if (!errors.direction) detector.shared.direction_sigma_m = 0.0;
  if (!errors.range) detector.shared.radial_bias_share = 0.0;
  detector.position_sigma_m =
      std::hypot(sim::kMeasuredIndependentSigmaM, errors.along ? 0.0 : measured.along_sigma_m,
                 errors.direction ? 0.0 : measured.direction_sigma_m);
  return detector;
}

Survey read_survey(const SurveyedDrive& drive, const std::filesystem::path& data) {
  Survey survey;
  survey.forest = read_stems(data / drive.map, drive.diameter_cm);
  if (drive.way.ends_with(".csv")) survey.recorded_m = read_stems(data / drive.way, {}).trunks_m;
  return survey;
}

std::vector<model::StemFrame> drive_frames(const SurveyedDrive& drive, const Survey& survey,
                                           StemErrors errors, std::uint64_t seed) {
  const auto kind = sim::stem_way(drive.way);
  const sim::Route way = kind ? sim::make_stem_way(*kind, survey.forest, drive.length_m, seed)
                              : sim::fit_stem_way(survey.recorded_m, survey.forest);
  sim::StemDriveParameters parameters = drive.drive;
  parameters.detector = with_errors(parameters.detector, errors);
  return sim::drive_stem_frames(survey.forest, way, parameters, seed);
}

}  // namespace understory::eval::experiments::shared_errors
