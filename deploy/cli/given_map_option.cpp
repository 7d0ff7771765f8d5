#include "deploy/cli/given_map_option.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>

#include "common/io/text_file.hpp"
#include "common/map_file/map_file.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/text_file.hpp"
#include "services/geoslam_mapper/given_map.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;

/// The number of the map with which the mapper will begin. Reads it like the mapper.
std::uint32_t number_of_given(const GivenMapOptions& options) {
  const model::WholeMap map =
      geoslam_mapper::read_given_map(options.file, static_cast<int>(options.map_id));
  return model::map_of(map.landmarks.back().id);
}

std::string checksum_in_file(const std::string& file, std::uint32_t map_id) {
  const auto maps = map_file::MapFile(file, map_file::Access::kRead).maps();
  return std::ranges::find(maps, map_id, &map_file::MapSummary::map_id)->checksum;
}

/// Whether the folder has a process's state.
bool has_state(const fs::path& folder) {
  if (!fs::is_directory(folder)) return false;
  return std::ranges::any_of(fs::directory_iterator(folder), [](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name.find(".snapshot") != std::string::npos ||
           name.find(".journal") != std::string::npos;
  });
}

}  // namespace

void add_given_map_options(CLI::App& command, GivenMapOptions& options) {
  const std::string group = "Given map";
  auto* map = command.add_option("--map", options.file,
                                 "Map file to begin in, at any place of it (see `understory map`)");
  map->group(group);
  command.add_option("--map-id", options.map_id, "Number of the map, if the file has several")
      ->group(group)
      ->needs(map)
      ->check(CLI::Range(std::uint32_t{1}, map_file::kLastMapId));
  command.add_flag("--localisation-only", options.localisation_only, "Do not change the map")
      ->group(group)
      ->needs(map);
}

GivenMapLayers given_map_layers(const GivenMapOptions& options, const fs::path& file,
                                const std::vector<std::string>& processes) {
  if (std::ranges::find(processes, kMapperProcess) == processes.end())
    wrong_usage(fmt::format("--map {}: no {} runs, only: {}", options.file, kMapperProcess,
                            fmt::join(processes, ", ")));

  const std::uint32_t map_id = number_of_given(options);
  toml::table input{{"map_file", file.string()}, {"map_id", static_cast<std::int64_t>(map_id)}};
  GivenMapLayers given{{}, checksum_in_file(options.file, map_id)};
  if (std::ranges::find(processes, kTrackerProcess) != processes.end())
    given.layers[kTrackerProcess] = {"--map", toml::table{{"input", input}}};

  toml::table values;
  values.insert("input", std::move(input));
  if (options.localisation_only)
    values.insert("smoothing", toml::table{{"localisation_only", true}});
  given.layers[kMapperProcess] = {"--map", std::move(values)};
  return given;
}

fs::path layer_file(const fs::path& state_folder) { return state_folder / "given_map.toml"; }

void keep_layer(const fs::path& state_folder, const fs::path& base, const bus::ConfigLayer& layer,
                const std::string& checksum) {
  const fs::path file = layer_file(state_folder);
  const std::string text =
      fmt::format("# Map with checksum {}\n{}", checksum, bus::layer_over(base, layer.table));
  const bool is_same = fs::exists(file) && io::read_whole_file(file) == text;
  if (is_same) return;

  if (has_state(state_folder))
    fail(
        fmt::format("{}: the state of an earlier drive, which began without this map, goes before "
                    "--map; --fresh forgets it",
                    state_folder.string()));
  write_text_file(file, text);
}

}  // namespace understory::cli
