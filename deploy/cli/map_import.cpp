// `understory map import`: maps from surveys and drives into a map file.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <optional>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/io/landmark_table.hpp"
#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_maps.hpp"
#include "deploy/cli/map_commands.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using map_file::StoredMap;

struct MapImportOptions {
  std::string source;
  std::string out;
  std::string name;
  std::string columns;
  std::vector<double> origin_m{0.0, 0.0};  ///< Of the map, in the table's frame.
  std::uint32_t map_id = 0;                ///< 0 = the next free one.
  double sigma_m = 0.1;
  double near_m = 0.1;
  bool replace = false;
};

/// Pairs that are listed one by one.
constexpr std::size_t kMostPairs = 10;

/// By its first bytes, else by its name: an empty or damaged log is none of a table either.
bool is_lcm_log(const fs::path& file) {
  constexpr std::array<char, 4> kMagic{'\xED', '\xA1', '\xDA', '\x01'};
  std::array<char, 4> start{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), start.size());
  return start == kMagic || file.extension() == ".lcm";
}

void report_close_pairs(const std::string& source, const std::vector<io::LandmarkRow>& rows,
                        double near_m) {
  const std::vector<io::ClosePair> pairs = io::close_pairs(rows, near_m);
  for (std::size_t i = 0; i < std::min(pairs.size(), kMostPairs); ++i) {
    fmt::print(stderr, "{}: lines {} and {} are {:.3f} m apart\n", source,
               rows[pairs[i].first].line, rows[pairs[i].second].line, pairs[i].distance_m);
  }
  if (!pairs.empty())
    fmt::print(stderr, "{}: {} pairs of landmarks nearer than {} m: doubles?\n", source,
               pairs.size(), near_m);
}

std::vector<io::NamedColumn> named_columns(const MapImportOptions& options) {
  try {
    return io::parse_named_columns(options.columns);
  } catch (const std::invalid_argument& error) {
    wrong_usage(fmt::format("--columns: {}", error.what()));
  }
}

StoredMap map_of_table(const MapImportOptions& options) {
  const auto [rows, passed_over] =
      io::parse_landmark_table(io::read_whole_file(options.source), options.source,
                               {options.sigma_m, named_columns(options)});
  if (!passed_over.empty())
    fmt::print(stderr, "{}: columns that were not read: {}\n", options.source,
               fmt::join(passed_over, ", "));
  report_close_pairs(options.source, rows, options.near_m);

  StoredMap map;
  map.map_id = options.map_id;
  map.landmarks.reserve(rows.size());
  const Eigen::Vector2d origin_m(options.origin_m[0], options.origin_m[1]);
  double farthest_m = 0.0;
  for (const io::LandmarkRow& row : rows) {
    map.landmarks.push_back({row.landmark, std::nullopt, std::nullopt});
    Eigen::Vector2d& position_m = map.landmarks.back().landmark.position_m;
    position_m -= origin_m;
    farthest_m = std::max(farthest_m, position_m.cwiseAbs().maxCoeff());
    map.landmarks.back().landmark.id = map_file::landmark_id(options.map_id, map.landmarks.size());
  }

  if (farthest_m > constellation::PointGrid::kMaxCoordinate)
    fmt::print(stderr,
               "{}: coordinates reach {:.0f} m: the map can be kept and exported, but nothing is "
               "located farther than 2,000 km from its origin (--origin X,Y moves it there)\n",
               options.source, farthest_m);
  return map;
}

StoredMap map_of_drive(std::uint32_t map_id, const LogMaps::Found& found) {
  const model::WholeMap& whole = found.map;
  StoredMap map;
  map.map_id = map_id;
  map.created_utime = whole.utime;
  map.landmarks.reserve(whole.landmarks.size());
  for (const model::MapLandmark& landmark : whole.landmarks)
    map.landmarks.push_back({landmark, std::nullopt, std::nullopt});
  map.keyframes = whole.keyframes;
  if (found.existence) map_file::give_existence(map, *found.existence);
  return map;
}

std::map<std::uint32_t, LogMaps::Found> read_log_maps(const std::string& log) {
  LogMaps maps;
  io::LcmLogReader reader(log);
  terminal::Progress progress("reading " + log, static_cast<double>(reader.size_bytes()));
  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    maps.add(*event);
    progress.update(static_cast<double>(reader.position_bytes()));
  }
  reader.refuse_other_files();
  return maps.take();
}

std::vector<StoredMap> maps_of_log(const MapImportOptions& options) {
  if (options.map_id != 0) wrong_usage("--map: the maps of a log have their own numbers");
  std::vector<StoredMap> maps;
  for (const auto& [id, found] : read_log_maps(options.source)) {
    if (found.missed > 0)
      fmt::print(stderr, "{}: map {}: {} changes are missing: some landmarks may be old\n",
                 options.source, id, found.missed);
    maps.push_back(map_of_drive(id, found));
  }

  if (maps.empty())
    fail(fmt::format("{}: neither a whole MAP nor the start of one in it (run replay first)",
                     options.source));
  return maps;
}

std::uint32_t next_free(const std::vector<map_file::MapSummary>& maps) {
  return maps.empty() ? 1 : maps.back().map_id + 1;
}

void refuse_known(const MapImportOptions& options, const std::vector<StoredMap>& maps,
                  const std::vector<map_file::MapSummary>& known) {
  if (options.replace) return;
  for (const StoredMap& map : maps) {
    const bool is_known =
        std::ranges::find(known, map.map_id, &map_file::MapSummary::map_id) != known.end();
    if (is_known)
      fail(fmt::format("{}: has a map {} already (--replace puts the new one in its place)",
                       options.out, map.map_id));
  }
}

std::vector<StoredMap> read_maps(MapImportOptions options, const map_file::ChangeNote& note,
                                 const std::vector<map_file::MapSummary>& known) {
  const bool is_log = is_lcm_log(options.source);
  if (!is_log && options.map_id == 0) options.map_id = next_free(known);
  std::vector<StoredMap> maps;
  if (is_log) {
    maps = maps_of_log(options);
  } else {
    maps.push_back(map_of_table(options));
    maps.back().created_utime = note.utime;
  }

  for (StoredMap& map : maps) {
    map.name = options.name.empty() ? fs::path(options.source).stem().string() : options.name;
    map.origin = note.source;
  }
  refuse_known(options, maps, known);
  return maps;
}

std::string count_text(const std::vector<StoredMap>& maps) {
  std::string text;
  for (const StoredMap& map : maps) {
    text += fmt::format("{}map {} of {} landmarks and {} keyframes", text.empty() ? "" : ", ",
                        map.map_id, map.landmarks.size(), map.keyframes.size());
    if (map.existence)
      text += fmt::format(" ({} with a state of existence)", map.existence->landmarks.size());
  }
  return text;
}

void run_map_import(const MapImportOptions& options) {
  // What is half made goes with an interrupt.
  terminal::catch_interrupts();
  map_file::ChangeNote note =
      note_now("understory map import", fs::path(options.source).filename().string(), "");
  std::vector<StoredMap> maps;
  if (fs::exists(options.out)) {
    map_file::MapFile file(options.out, map_file::Access::kWrite);
    maps = read_maps(options, note, file.maps());
    terminal::throw_if_interrupted();
    note.text = count_text(maps);
    file.put(maps, note);
  } else {
    maps = read_maps(options, note, {});
    terminal::throw_if_interrupted();
    note.text = count_text(maps);
    map_file::create_map_file(options.out, maps, note);
  }
  fmt::print("{} -> {}\n", note.text, options.out);
}

}  // namespace

void add_map_import(CLI::App& map) {
  auto* command = map.add_subcommand(
      "import", "A survey (CSV) or the maps that were built in a log, into a map file");
  const auto options = std::make_shared<MapImportOptions>();
  command
      ->add_option("source", options->source,
                   "CSV with the columns x_m,y_m[,sigma_m][,dbh_m][,kind] (or easting, northing, "
                   "'BHD [cm]' and the like), or an LCM log with the mapper's output")
      ->required();
  command->add_option("--out", options->out, "The map file; made, or added to")->required();
  command
      ->add_option("--origin", options->origin_m,
                   "[m] Where the map's origin lies in the table's frame: X,Y. It is subtracted")
      ->delimiter(',')
      ->expected(2);
  command->add_option("--columns", options->columns,
                      "Which column is what, where the headings do not say it: "
                      "x=HEADING,y=HEADING,dbh_cm=HEADING,sigma_m=HEADING,kind=HEADING");
  command
      ->add_option("--sigma-m", options->sigma_m,
                   "[m] Standard deviation in x and in y where the table has no sigma_m")
      ->check(CLI::Range(1e-6, 1e3))
      ->capture_default_str();
  command
      ->add_option("--near-m", options->near_m,
                   "[m] Landmarks of the table that are nearer to each other are reported; 0: "
                   "none")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  command->add_option("--map", options->map_id, "Number of the table's map (default: the next)")
      ->check(CLI::Range(std::uint32_t{1}, map_file::kLastMapId));
  command->add_option("--name", options->name, "Name of the map (default: the source's)");
  command->add_flag("--replace", options->replace, "Take the place of a map of the same number");
  command->callback([options] { guarded_map_work([&] { run_map_import(*options); }); });
}

}  // namespace understory::cli
