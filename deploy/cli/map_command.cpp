// `understory map info|check|import|georeference|export|merge|close|log|revert|accept|diff`: stored
// maps.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/map_file/difference.hpp"
#include "common/map_file/map_look.hpp"
#include "common/reference_system/reference_system.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/map_table.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

using map_file::Access;
using map_file::Change;
using map_file::MapFile;
using map_file::MapSummary;

struct MapOptions {
  std::string file;
  std::string other;
  bool json = false;
  std::uint64_t to = 0;
  map_file::DifferenceLimits limits{.quantile = 0.99, .unknown_sigma_m = 0.1};
};

/// UTC, to the second. Stamps of simulated drives count from 0.
std::string time_text(model::Utime utime) {
  // Beyond the year 9999 there are only damaged stamps.
  constexpr model::Utime kLast = 253'402'300'799'000'000;
  if (utime < 0 || utime > kLast) return fmt::format("{} us", utime);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}",
                     fmt::gmtime(static_cast<std::time_t>(utime / 1'000'000)));
}

nlohmann::ordered_json summary_json(const MapSummary& map) {
  return {{"map_id", map.map_id},
          {"name", map.name},
          {"created_utime", map.created_utime},
          {"origin", map.origin},
          {"trunks", map.trunks},
          {"corners", map.corners},
          {"keyframes", map.keyframes},
          {"submap_borders", map.submap_borders},
          {"loop_closures", map.loop_closures},
          {"existence_states", map.existence_states},
          {"not_in_use", map.not_in_use},
          {"checksum", map.checksum}};
}

nlohmann::ordered_json reference_json(const std::optional<model::MapReference>& reference) {
  if (!reference) return nullptr;
  return {{"system", reference->system},
          {"latitude_deg", reference->latitude_deg},
          {"longitude_deg", reference->longitude_deg},
          {"rotation_rad", reference->rotation_rad},
          {"definition", reference->definition}};
}

/// The value of --json must not be a file.
CLI::Validator no_dash() {
  return {
      [](const std::string& value) { return value == "-" ? "- is no map file" : std::string(); },
      "", "no dash"};
}

/// --json, also as `--json -`, which names standard output.
void add_json_flag(CLI::App& command, bool& is_json) {
  auto* const flag = command.add_flag("--json", is_json, "As JSON, on standard output");
  command
      .add_option_function<std::string>(
          "stdout", [](const std::string& /*dash*/) {}, "")
      ->check(CLI::IsMember({"-"}))
      ->needs(flag)
      ->group("");
  command.validate_positionals();
}

void map_info(const MapOptions& options) {
  const map_file::MapLook look(options.file);
  const MapFile& file = look.file();
  if (!look.remark().empty()) fmt::print(stderr, "{}: {}\n", options.file, look.remark());
  const std::vector<MapSummary> maps = file.maps();
  const std::size_t changes = file.history().size();
  if (options.json) {
    nlohmann::ordered_json json{{"file", options.file},
                                {"written_by", file.program_version()},
                                {"changes", changes},
                                {"reference", reference_json(file.reference())},
                                {"maps", nlohmann::ordered_json::array()}};
    for (const MapSummary& map : maps) json["maps"].push_back(summary_json(map));
    fmt::print("{}\n", result_text(json, 2));
    return;
  }

  const std::string version = terminal::printable(file.program_version());
  fmt::print("{}: {} maps, {} changes{}\n", options.file, maps.size(), changes,
             version.empty() ? version : ", written by version " + version);
  if (const auto reference = file.reference())
    fmt::print("{}\n", terminal::printable(place_text(*reference)));
  fmt::print("{:>5} {:>9} {:>9} {:>9} {:19} {:12} {} (from)\n", "map", "trunks", "corners",
             "keyframes", "made", "checksum", "name");
  for (const MapSummary& map : maps) {
    fmt::print("{:>5} {:>9} {:>9} {:>9} {:19} {:12} {} ({})\n", map.map_id, map.trunks, map.corners,
               map.keyframes, time_text(map.created_utime),
               terminal::printable(map.checksum.substr(0, 12)), terminal::printable(map.name),
               terminal::printable(map.origin));
  }
  for (const MapSummary& map : maps) {
    if (map.existence_states > 0)
      fmt::print("map {}: {} landmarks have a state of existence, {} of them are not in use\n",
                 map.map_id, map.existence_states, map.not_in_use);
  }
}

void map_check(const MapOptions& options) {
  const MapFile file(options.file, Access::kRead);
  const std::vector<std::string> findings = file.check();
  for (const std::string& finding : findings) fmt::print("{}\n", terminal::printable(finding));
  if (!findings.empty()) fail(fmt::format("{}: {} findings", options.file, findings.size()));
  fmt::print("{}: {} maps, {} changes, nothing wrong\n", options.file, file.maps().size(),
             file.history().size());
}

void map_log(const MapOptions& options) {
  const MapFile file(options.file, Access::kRead);
  nlohmann::ordered_json json{{"file", options.file}, {"changes", nlohmann::ordered_json::array()}};
  for (const Change& change : file.history()) {
    const map_file::ChangeNote& note = change.note;
    json["changes"].push_back({{"number", change.number},
                               {"utime", note.utime},
                               {"command", note.command},
                               {"source", note.source},
                               {"text", note.text},
                               {"bytes", change.bytes}});
    if (options.json) continue;
    fmt::print("{:>4} {} {} {}: {}\n", change.number, time_text(note.utime),
               terminal::printable(note.command), terminal::printable(note.source),
               terminal::printable(note.text));
  }
  if (options.json) fmt::print("{}\n", result_text(json, 2));
}

void map_revert(const MapOptions& options) {
  MapFile file(options.file, Access::kWrite);
  const std::uint64_t number = file.revert(
      options.to, note_now("understory map revert", fmt::format("change {}", options.to),
                           fmt::format("back to what was after change {}", options.to)));
  fmt::print("{}: as it was after change {} (change {})\n", options.file, options.to, number);
}

void map_accept(const MapOptions& options) {
  MapFile file(options.file, Access::kWrite);
  const std::uint64_t number = file.accept(
      note_now("understory map accept", "another program", "what another program changed"));
  fmt::print("{}: what another program changed is change {} now\n", options.file, number);
}

/// An empty map where the file has none of this number.
map_file::StoredMap map_or_nothing(const MapFile& file, const std::set<std::uint32_t>& ids,
                                   std::uint32_t id) {
  return ids.contains(id) ? file.read(id) : map_file::StoredMap{};
}

std::set<std::uint32_t> ids_in(const MapFile& file) {
  std::set<std::uint32_t> ids;
  for (const MapSummary& map : file.maps()) ids.insert(map.map_id);
  return ids;
}

nlohmann::ordered_json number_or_null(const std::optional<double>& number) {
  return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json difference_json(std::uint32_t map_id,
                                       const map_file::MapDifference& difference) {
  nlohmann::ordered_json json{{"map_id", map_id},
                              {"added", difference.added},
                              {"removed", difference.removed},
                              {"moved", nlohmann::ordered_json::array()},
                              {"kept", difference.kept},
                              {"existence", nlohmann::ordered_json::array()}};
  for (const map_file::MovedLandmark& move : difference.moved) {
    // JSON has no infinity: such a landmark's error is unknown.
    const nlohmann::ordered_json chi2 =
        std::isfinite(move.chi2) ? nlohmann::ordered_json(move.chi2) : nullptr;
    json["moved"].push_back({{"id", move.id}, {"distance_m", move.distance_m}, {"chi2", chi2}});
  }
  for (const map_file::ExistenceChange& change : difference.existence)
    json["existence"].push_back({{"id", change.id},
                                 {"was_in_use", change.was_in_use},
                                 {"is_in_use", change.is_in_use},
                                 {"probability_before", number_or_null(change.probability_before)},
                                 {"probability_after", number_or_null(change.probability_after)}});
  return json;
}

const char* change_of_use(const map_file::ExistenceChange& change) {
  if (change.was_in_use == change.is_in_use) return change.is_in_use ? "in use" : "unused";
  return change.is_in_use ? "used again" : "left use";
}

void print_existence(const std::vector<map_file::ExistenceChange>& changes) {
  if (changes.empty()) return;
  const auto text = [](const std::optional<double>& probability) {
    return probability ? fmt::format("{:.3f}", *probability) : std::string("unknown");
  };
  const auto left = std::ranges::count_if(
      changes, [](const auto& one) { return one.was_in_use && !one.is_in_use; });
  const auto back = std::ranges::count_if(
      changes, [](const auto& one) { return !one.was_in_use && one.is_in_use; });
  fmt::print("  existence: {} left use, {} used again, {} more probabilities changed\n", left, back,
             static_cast<std::ptrdiff_t>(changes.size()) - left - back);
  for (const map_file::ExistenceChange& change : changes)
    fmt::print("  {:10} {} probability {} -> {}\n", change_of_use(change), change.id,
               text(change.probability_before), text(change.probability_after));
}

void print_difference(std::uint32_t map_id, const map_file::MapDifference& difference) {
  fmt::print("map {}: {} added, {} removed, {} moved, {} kept\n", map_id, difference.added.size(),
             difference.removed.size(), difference.moved.size(), difference.kept);
  for (const model::LandmarkId id : difference.added) fmt::print("  added   {}\n", id);
  for (const model::LandmarkId id : difference.removed) fmt::print("  removed {}\n", id);
  for (const map_file::MovedLandmark& move : difference.moved)
    fmt::print("  moved   {} by {:.3f} m, chi2 {:.1f}\n", move.id, move.distance_m, move.chi2);
  print_existence(difference.existence);
}

void map_diff(const MapOptions& options) {
  const MapFile before(options.file, Access::kRead);
  const MapFile after(options.other, Access::kRead);
  const auto frame_before = before.reference();
  const auto frame_after = after.reference();
  if (frame_before && frame_after && frame_before->definition != frame_after->definition)
    fail(fmt::format("{} and {}: are georeferenced differently: {}; {}", options.file,
                     options.other, place_text(*frame_before), place_text(*frame_after)));
  const std::set<std::uint32_t> before_ids = ids_in(before);
  const std::set<std::uint32_t> after_ids = ids_in(after);
  std::set<std::uint32_t> all = before_ids;
  all.insert(after_ids.begin(), after_ids.end());

  const double chi2 = map_file::chi2_of_quantile(options.limits.quantile);
  nlohmann::ordered_json json{{"before", options.file},
                              {"after", options.other},
                              {"quantile", options.limits.quantile},
                              {"unknown_sigma_m", options.limits.unknown_sigma_m},
                              {"probability_change", options.limits.probability_change},
                              {"chi2", chi2},
                              {"maps", nlohmann::ordered_json::array()}};
  for (const std::uint32_t id : all) {
    const auto difference =
        map_file::difference(map_or_nothing(before, before_ids, id),
                             map_or_nothing(after, after_ids, id), options.limits);
    json["maps"].push_back(difference_json(id, difference));
    if (!options.json) print_difference(id, difference);
  }

  if (options.json) {
    fmt::print("{}\n", result_text(json, 2));
  } else {
    fmt::print(
        "landmarks by id, frames taken to be the same; moved: beyond the quantile {} (chi2 {:.2f}, "
        "2 "
        "degrees of freedom), sigma {} m where there is no covariance\n",
        options.limits.quantile, chi2, options.limits.unknown_sigma_m);
  }
}

}  // namespace

void guarded_map_work(const std::function<void()>& work) {
  try {
    work();
  } catch (const map_file::MapFileError& error) {
    fail(error.what());
  } catch (const io::DataError& error) {
    fail(error.what());
  } catch (const reference_system::ReferenceError& error) {
    fail(error.what());
  } catch (const io::LogError& error) {
    fail(error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    fail(error.what());
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("map: {}", error.what()));
  }
}

map_file::ChangeNote note_now(std::string command, std::string source, std::string text) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::microseconds>(now).count(), std::move(command),
          std::move(source), std::move(text)};
}

void add_map_command(CLI::App& parent) {
  auto* map = parent.add_subcommand("map", "Stored maps: SQLite files that are GeoPackages");
  map->require_subcommand(1);
  const auto options = std::make_shared<MapOptions>();
  const auto add = [&](const char* name, const char* description, void (*work)(const MapOptions&)) {
    auto* command = map->add_subcommand(name, description);
    command->add_option("file", options->file, "A map file")->required()->check(no_dash());
    command->callback([options, work] { guarded_map_work([&] { work(*options); }); });
    return command;
  };

  add_json_flag(*add("info", "Contents of a map file", map_info), options->json);
  add("check", "Faults of a map file; exit status 1 if there are any", map_check);
  add_map_import(*map);
  add_map_georeference(*map);
  add_map_export(*map);
  add_map_merge(*map);
  add_map_close(*map);
  add_json_flag(*add("log", "Changes of a map file, the oldest first", map_log), options->json);

  add("revert", "Restores all maps as they were after a change; this is a new change", map_revert)
      ->add_option("--to", options->to, "Number of the change; 0: before the first one")
      ->required();
  add("accept", "Records the edits of another program (e.g. QGIS) as a change", map_accept);
  auto* diff =
      add("diff", "Landmarks added, removed, moved, out of use and back from one file to another",
          map_diff);
  diff->add_option("other", options->other, "The later map file")->required()->check(no_dash());
  diff->add_option("--quantile", options->limits.quantile,
                   "A landmark has moved if the chi2 of its displacement, by both covariances, "
                   "exceeds this quantile")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  diff->add_option("--sigma-m", options->limits.unknown_sigma_m,
                   "[m] Standard deviation in x and in y of landmarks without covariance")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  diff->add_option("--probability-change", options->limits.probability_change,
                   "Least change of a probability of existence that is listed; landmarks that left "
                   "use or are used again always are")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  add_json_flag(*diff, options->json);
}

}  // namespace understory::cli
