// `understory map import`: maps from surveys and drives into a map file.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "common/io/lcm_log_format.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_maps.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/map_table.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using map_file::StoredMap;

struct MapImportOptions {
  std::string out;
  std::string name;
  MapTableOptions table;  ///< Its map_id 0 = the next free one.
  bool replace = false;
  bool same_frame = false;

  const std::string& source() const { return table.source; }
};

/// What the file has that is imported into.
struct KnownFile {
  std::vector<map_file::MapSummary> maps;
  std::optional<model::MapReference> reference;
};

/// Maps to be stored, and where their frame lies.
struct MapsToStore {
  std::vector<StoredMap> maps;
  std::optional<model::MapReference> reference;
};

/// By its first bytes, else by its name: an empty or damaged log is none of a table either.
bool is_lcm_log(const fs::path& file) {
  return io::begins_as_log(file) || file.extension() == ".lcm";
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
  const MapTableOptions& table = options.table;
  if (table.map_id != 0) wrong_usage("--map: the maps of a log have their own numbers");
  if (!table.crs.empty() || !table.origin.empty())
    wrong_usage(
        "--crs, --origin: are for tables; `understory map georeference` is for maps of drives");
  std::vector<StoredMap> maps;
  for (const auto& [id, found] : read_log_maps(options.source())) {
    if (found.missed > 0)
      fmt::print(stderr, "{}: map {}: {} changes are missing: some landmarks may be old\n",
                 options.source(), id, found.missed);
    maps.push_back(map_of_drive(id, found));
  }

  if (maps.empty())
    fail(fmt::format("{}: neither a whole MAP nor the start of one in it (run replay first)",
                     options.source()));
  return maps;
}

std::uint32_t next_free(const std::vector<map_file::MapSummary>& maps) {
  return maps.empty() ? 1 : maps.back().map_id + 1;
}

bool has_map(const std::vector<map_file::MapSummary>& known, std::uint32_t map_id) {
  return std::ranges::find(known, map_id, &map_file::MapSummary::map_id) != known.end();
}

void refuse_known(const MapImportOptions& options, const std::vector<StoredMap>& maps,
                  const std::vector<map_file::MapSummary>& known) {
  if (options.replace) return;
  for (const StoredMap& map : maps) {
    if (has_map(known, map.map_id))
      fail(fmt::format("{}: has a map {} already (--replace puts the new one in its place)",
                       options.out, map.map_id));
  }
}

/// The map of these landmarks that the file has and that stays there; 0 for none.
std::uint32_t joined_map(const StoredMap& map, const std::vector<map_file::MapSummary>& known) {
  for (const map_file::StoredLandmark& one : map.landmarks) {
    const std::uint32_t from = model::map_of(one.landmark.id);
    if (from != map.map_id && has_map(known, from)) return from;
  }
  return 0;
}

/// A landmark is in one map of a file: a map that took another one in cannot be beside it.
void refuse_joined(const MapImportOptions& options, const std::vector<StoredMap>& maps,
                   const std::vector<map_file::MapSummary>& known) {
  for (const StoredMap& map : maps) {
    if (const std::uint32_t from = joined_map(map, known); from != 0)
      fail(
          fmt::format("{}: map {} became part of map {} in {}, in the frame of map {}: import it "
                      "into another file (`understory map merge` joins the two)",
                      options.out, from, map.map_id, options.source(), map.map_id));
  }
}

/// Of the maps of a drive that began in a map of the file those in its frame. A map that the mapper
/// began later (the vehicle was lost) has a frame of its own.
void keep_same_frame(const MapImportOptions& options,
                     const std::vector<map_file::MapSummary>& known, std::vector<StoredMap>& maps) {
  const auto is_known = [&](const StoredMap& map) { return has_map(known, map.map_id); };
  const auto first_other = std::stable_partition(maps.begin(), maps.end(), is_known);
  std::string others;
  for (auto one = first_other; one != maps.end(); ++one)
    others += fmt::format("{}{}", others.empty() ? "" : ", ", one->map_id);
  if (others.empty()) return;
  const std::string text = fmt::format(
      "{}: map {} is not imported: the drive began it where it was lost, in another frame than the "
      "maps of {} (without --same-frame into another file; `understory map merge` joins the two)",
      options.source(), others, options.out);
  maps.erase(first_other, maps.end());
  if (maps.empty()) fail(text);
  fmt::print(stderr, "{}\n", text);
}

/// All maps of a file share one frame: what is added must be in it.
void require_same_frame(const MapImportOptions& options, const KnownFile& known, bool is_log) {
  const bool states_system = !options.table.crs.empty();
  if (states_system && options.same_frame)
    wrong_usage("--crs and --same-frame: the table is in the one or in the other");
  if (known.reference && states_system && !options.table.origin.empty())
    wrong_usage(fmt::format("--origin: {} has one already", options.out));

  if (known.reference && !states_system && !options.same_frame)
    fail(fmt::format(
        "{}: is georeferenced ({}): {}--same-frame says that the coordinates in {} are "
        "metres in the frame of its maps",
        options.out, known.reference->system,
        is_log ? "" : "--crs CODE says the reference system of the table, ", options.source()));
  if (!known.reference && !known.maps.empty() && states_system)
    fail(
        fmt::format("{}: is not georeferenced, so a table in {} cannot be added to its maps "
                    "(`understory map georeference`, or another --out)",
                    options.out, options.table.crs));
}

MapsToStore read_maps(MapImportOptions options, const map_file::ChangeNote& note,
                      const KnownFile& known) {
  const bool is_log = is_lcm_log(options.source());
  require_same_frame(options, known, is_log);
  if (!is_log && options.table.map_id == 0) options.table.map_id = next_free(known.maps);
  MapsToStore read;
  if (is_log) {
    read.maps = maps_of_log(options);
    if (options.same_frame && !known.maps.empty()) keep_same_frame(options, known.maps, read.maps);
    refuse_joined(options, read.maps, known.maps);
  } else {
    MapOfTable table = map_of_table(options.table, known.reference);
    read.reference = std::move(table.reference);
    read.maps.push_back(std::move(table.map));
    read.maps.back().created_utime = note.utime;
  }

  for (StoredMap& map : read.maps) {
    map.name = options.name.empty() ? fs::path(options.source()).stem().string() : options.name;
    map.origin = note.source;
  }
  refuse_known(options, read.maps, known.maps);
  return read;
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
      note_now("understory map import", fs::path(options.source()).filename().string(), "");

  if (fs::exists(options.out)) {
    map_file::MapFile file(options.out, map_file::Access::kWrite);
    const MapsToStore read = read_maps(options, note, {file.maps(), file.reference()});
    terminal::throw_if_interrupted();
    note.text = count_text(read.maps);
    if (read.reference && !file.reference()) {
      // A file without maps: its frame is that of the first one.
      map_file::ChangeNote placed = note;
      placed.text = place_text(*read.reference);
      file.put(*read.reference, placed);
    }
    file.put(read.maps, note);
  } else {
    const MapsToStore read = read_maps(options, note, {});
    terminal::throw_if_interrupted();
    note.text = count_text(read.maps);
    map_file::create_map_file(options.out, read.maps, note, read.reference);
  }
  fmt::print("{} -> {}\n", note.text, options.out);
}

/// Where the coordinates of a table lie.
void add_place_options(CLI::App& command, MapImportOptions& options) {
  command
      .add_option("--origin", options.table.origin,
                  "Origin of the map in the table's coordinates: EAST,NORTH, or LAT,LON in degrees "
                  "(default: 0,0; with --crs near the middle of the table)")
      ->delimiter(',')
      ->expected(2);
  command.add_option("--crs", options.table.crs,
                     "Reference system of the table: EPSG:25832, EPSG:4326, ... Coordinates become "
                     "metres from the map's origin, whose place is kept in the file");
  command.add_flag("--force", options.table.is_far_allowed,
                   "Accept coordinates more than 1,000 km outside of the area of --crs");
  command.add_flag("--same-frame", options.same_frame,
                   "Coordinates are metres in the frame of the maps in --out (a log: its drive "
                   "began with one of them)");
}

/// How the rows of a table become landmarks.
void add_table_options(CLI::App& command, MapTableOptions& table) {
  command.add_option("--columns", table.columns,
                     "Meaning of columns with other headings: x=HEADING,y=HEADING (or lat=, "
                     "lon=),dbh_cm=HEADING,sigma_m=HEADING,kind=HEADING");
  command
      .add_option("--sigma-m", table.sigma_m,
                  "[m] Standard deviation in x and in y where the table has no sigma_m")
      ->check(CLI::Range(1e-6, 1e3))
      ->capture_default_str();
  command
      .add_option("--near-m", table.near_m,
                  "[m] Landmarks of the table that are nearer to each other are reported; 0: none")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
}

}  // namespace

void add_map_import(CLI::App& map) {
  auto* command = map.add_subcommand(
      "import", "A survey (CSV) or the maps that were built in a log, into a map file");
  const auto options = std::make_shared<MapImportOptions>();
  command
      ->add_option("source", options->table.source,
                   "CSV with the columns x_m,y_m[,sigma_m][,dbh_m][,kind] (or easting, northing, "
                   "'BHD [cm]' and the like), or an LCM log with the mapper's output")
      ->required();
  command->add_option("--out", options->out, "The map file; created, or added to")->required();
  add_place_options(*command, *options);
  add_table_options(*command, options->table);
  command
      ->add_option("--map", options->table.map_id, "Number of the table's map (default: the next)")
      ->check(CLI::Range(std::uint32_t{1}, map_file::kLastMapId));
  command->add_option("--name", options->name, "Name of the map (default: the source's)");
  command->add_flag("--replace", options->replace, "Take the place of a map of the same number");
  command->callback([options] { guarded_map_work([&] { run_map_import(*options); }); });
}

}  // namespace understory::cli
