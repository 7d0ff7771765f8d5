// `understory map georeference`: sets the location of a file's maps on the earth.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>

#include "common/terminal/interrupt.hpp"
#include "deploy/cli/common_points.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/frame_check.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/map_table.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using map_file::MapFile;
using reference_system::Placing;

/// With a larger RMS, control points are wrong or belong to another map [m].
constexpr double kMostControlRms_m = 1.0;
/// Fixes under trees have errors of some metres.
constexpr double kMostFixRms_m = 10.0;
constexpr std::size_t kMostListedPoints = 20;
/// A scale that differs from 1 by more is reported.
constexpr double kOddScale = 1e-3;

struct GeoreferenceOptions {
  std::string file;
  std::string control_points;
  std::string fixes;
  std::string like;
  std::string crs;
  std::vector<double> antenna_m{0.0, 0.0};
  std::uint32_t map_id = 0;  ///< 0 = the only one with keyframes.
  std::optional<double> most_rms_m;
  bool force = false;
  bool replace = false;
  bool dry_run = false;
};

std::vector<map_file::StoredMap> all_maps(const MapFile& file) {
  std::vector<map_file::StoredMap> maps;
  for (const map_file::MapSummary& one : file.maps()) maps.push_back(file.read(one.map_id));
  return maps;
}

map_file::StoredMap driven_map(const MapFile& file, std::uint32_t map_id) {
  if (map_id != 0) return file.read(map_id);
  std::vector<std::uint32_t> driven;
  for (const map_file::MapSummary& one : file.maps())
    if (one.keyframes > 0) driven.push_back(one.map_id);
  if (driven.size() != 1)
    fail(fmt::format("{}: {} maps with keyframes are in it{}", file.file().string(), driven.size(),
                     driven.empty() ? ": fixes are compared with a drive" : ": --map says which"));
  return file.read(driven.front());
}

/// Prints residuals, the worst first.
void print_residuals(const NamedPoints& known, const Placing& placing) {
  std::vector<std::size_t> order(placing.residuals_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, std::ranges::greater(),
                    [&](std::size_t i) { return placing.residuals_m[i]; });
  for (std::size_t i = 0; i < std::min(order.size(), kMostListedPoints); ++i)
    fmt::print("  {}: {:.3f} m off\n", known.names[order[i]], placing.residuals_m[order[i]]);
}

void print_placing(const NamedPoints& known, const Placing& placing, bool is_listed) {
  std::vector<double> sorted = placing.residuals_m;
  std::ranges::sort(sorted);
  fmt::print(
      "{} points, {:.0f} m from their middle at most: off by {:.3f} m (RMS), {:.3f} m "
      "(median), {:.3f} m (most)\n",
      known.points.size(), placing.reach_m, placing.rms_m, sorted[sorted.size() / 2],
      sorted.back());
  if (known.points.size() == 2)
    fmt::print("two points leave nothing over to check the placing with: a third one would\n");
  if (is_listed) print_residuals(known, placing);
  // Fixes are too inaccurate to determine a scale.
  if (is_listed && std::abs(placing.scale - 1.0) > kOddScale)
    fmt::print(
        "distances between the points are {:.5f} times those of the map, which stays as it "
        "is: another unit, another system?\n",
        placing.scale);
}

/// Root mean square of the residuals; for fixes without outliers, to which place_map() gives little
/// weight.
double rms_that_counts_m(const Placing& placing, bool is_by_hand) {
  if (is_by_hand) return placing.rms_m;
  std::vector<double> sorted = placing.residuals_m;
  std::ranges::sort(sorted);
  // Three sigma, by the median: it is 1.18 sigma of the distance in a plane.
  const double most_m = 3.0 / 1.18 * sorted[sorted.size() / 2];
  double sum = 0.0;
  double count = 0.0;
  for (const double residual_m : sorted) {
    if (residual_m > most_m) break;
    sum += residual_m * residual_m;
    count += 1.0;
  }
  const double wild = static_cast<double>(sorted.size()) - count;
  if (wild > 0.0)
    fmt::print("{:.0f} fixes are more than {:.2f} m off and count little\n", wild, most_m);
  return std::sqrt(sum / std::max(count, 1.0));
}

model::MapReference from_points(const GeoreferenceOptions& options, const MapFile& file) {
  const bool is_by_hand = !options.control_points.empty();
  const NamedPoints known =
      is_by_hand ? control_points_in(options.control_points, options.crs, all_maps(file))
                 : fixes_at_keyframes(options.fixes, driven_map(file, options.map_id),
                                      {{options.antenna_m[0], options.antenna_m[1]}});
  if (is_by_hand && !known.points.empty())
    check_area(options.control_points, options.crs, known.points.front().world, options.force);
  const Placing placing =
      reference_system::place_map(is_by_hand ? options.crs : "EPSG:4326", known.points);
  print_placing(known, placing, is_by_hand);

  const double most_m = options.most_rms_m.value_or(is_by_hand ? kMostControlRms_m : kMostFixRms_m);
  const double rms_m = rms_that_counts_m(placing, is_by_hand);
  if (rms_m > most_m)
    fail(fmt::format(
        "{}: not placed: {} does not fit the map: {:.3f} m (RMS) where {} m is the "
        "most (--most-rms-m); are the columns swapped, or is it another map?",
        options.file, is_by_hand ? options.control_points : options.fixes, rms_m, most_m));
  return placing.reference;
}

model::MapReference like_other(const GeoreferenceOptions& options, const MapFile& file) {
  const MapFile other(options.like, map_file::Access::kRead);
  const auto reference = other.reference();
  if (!reference) fail(fmt::format("{}: is not georeferenced", options.like));
  if (!options.force) require_one_frame(maps_in(file), maps_in(other));
  return *reference;
}

void require_one_source(const GeoreferenceOptions& options) {
  const int sources = static_cast<int>(!options.control_points.empty()) +
                      static_cast<int>(!options.fixes.empty()) +
                      static_cast<int>(!options.like.empty());
  if (sources != 1) wrong_usage("map georeference: one of --control-points, --fixes, --like");
  if (options.force && !options.fixes.empty())
    wrong_usage("map georeference: --force is of --like and --control-points");
  if (options.control_points.empty() != options.crs.empty())
    wrong_usage("map georeference: --crs is the reference system of --control-points");
}

void run_map_georeference(const GeoreferenceOptions& options) {
  terminal::catch_interrupts();
  require_one_source(options);
  std::optional<model::MapReference> reference;
  {
    const MapFile file(options.file, map_file::Access::kRead);
    if (file.reference() && !options.replace)
      fail(fmt::format("{}: is georeferenced already: {} (--replace)", options.file,
                       place_text(*file.reference())));
    reference = options.like.empty() ? from_points(options, file) : like_other(options, file);
  }
  fmt::print("{}\n", place_text(*reference));
  if (options.dry_run) return fmt::print("nothing was written (--dry-run)\n");

  const std::string& source = !options.like.empty()             ? options.like
                              : !options.control_points.empty() ? options.control_points
                                                                : options.fixes;
  MapFile file(options.file, map_file::Access::kWrite);
  const std::uint64_t change =
      file.put(*reference, note_now("understory map georeference",
                                    fs::path(source).filename().string(), place_text(*reference)));
  fmt::print("-> {} (change {})\n", options.file, change);
}

}  // namespace

void add_map_georeference(CLI::App& map) {
  auto* command = map.add_subcommand(
      "georeference",
      "Sets the place of a file's maps on the earth; coordinates stay. `map revert` undoes it");
  const auto options = std::make_shared<GeoreferenceOptions>();
  command->add_option("file", options->file, "A map file")->required();
  command->add_option("--control-points", options->control_points,
                      "A table of points that are known in both: map_x_m,map_y_m (or landmark_id) "
                      "and easting,northing (or lat,lon) in the system --crs");
  command->add_option("--crs", options->crs, "Reference system of the control points: EPSG:25832");

  command->add_option("--fixes", options->fixes,
                      "The log of the drive that made the map: its fixes (RAW_GNSS with latitude "
                      "and longitude) at the times of keyframes");
  command
      ->add_option("--antenna-m", options->antenna_m,
                   "[m] Place of the GNSS antenna on the vehicle: FORWARD,LEFT")
      ->delimiter(',')
      ->expected(2);
  command->add_option("--map", options->map_id, "Number of the map that the drive of --fixes made")
      ->check(CLI::Range(std::uint32_t{1}, map_file::kLastMapId));
  command->add_option("--like", options->like,
                      "A map file with which the drive of the maps began: the frame is the same; "
                      "the landmarks must agree");
  command->add_flag("--force", options->force,
                    "Use --like even if the landmarks do not agree; accept control points more "
                    "than 1,000 km outside of the area of --crs");

  command
      ->add_option("--most-rms-m", options->most_rms_m,
                   "[m] Largest RMS distance of the points from the map that is accepted (default: "
                   "1, fixes 10)")
      ->check(CLI::Range(1e-3, 1e3));
  command->add_flag("--replace", options->replace, "Replace the place that the file has already");
  command->add_flag("--dry-run", options->dry_run, "Show the place and write nothing");
  command->callback([options] { guarded_map_work([&] { run_map_georeference(*options); }); });
}

}  // namespace understory::cli
