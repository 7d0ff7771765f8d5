#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/changing_forest/changing_forest.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/drive_map.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::changing_forest {
namespace {

struct DrivesCommand {
  DrivesOptions drives;
  std::string part = "all";
  int runs = 2;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;
};

const char* name_of(Keeping keeping) {
  switch (keeping) {
    case Keeping::kTracker:
      return "existence tracker";
    case Keeping::kWithoutRanges:
      return "without ranges";
    default:
      return "nothing removed";
  }
}

const char* name_of(Part part) {
  switch (part) {
    case Part::kChanges:
      return "changes";
    case Part::kStack:
      return "stack";
    default:
      return "false detections";
  }
}

/// All, or those of one part.
std::vector<Variant> variants_of(const std::string& part) {
  std::vector<Variant> variants{{Part::kChanges, Keeping::kTracker, 0.0},
                                {Part::kChanges, Keeping::kNothing, 0.0},
                                {Part::kStack, Keeping::kTracker, 0.0},
                                {Part::kStack, Keeping::kWithoutRanges, 0.0},
                                {Part::kFalseDetections, Keeping::kTracker, 0.1},
                                {Part::kFalseDetections, Keeping::kNothing, 0.1},
                                {Part::kFalseDetections, Keeping::kTracker, 0.3},
                                {Part::kFalseDetections, Keeping::kNothing, 0.3}};
  std::erase_if(variants,
                [&](const Variant& one) { return part != "all" && part != name_of(one.part); });
  return variants;
}

nlohmann::json row_of(std::uint64_t seed, const Variant& variant, const DriveScore& score) {
  const harness::MappingSignal last =
      score.signals.empty() ? harness::MappingSignal{} : score.signals.back();
  return {{"run_seed", seed},
          {"part", name_of(variant.part)},
          {"keeping", name_of(variant.keeping)},
          {"false_wanted", variant.false_share},
          {"false_share", score.false_share},
          {"hidden", score.hidden},
          {"hidden_unused", score.hidden_unused},
          {"drive", score.drive},
          {"standing", score.standing},
          {"found", score.found},
          {"in_use", score.in_use},
          {"right", score.right},
          {"stored", score.stored},
          {"felled", score.felled},
          {"felled_unused", score.felled_unused},
          {"felled_hidden", score.felled_hidden},
          {"felled_hidden_unused", score.felled_hidden_unused},
          {"wrongly_unused", score.wrongly_unused},
          {"ate_m", score.ate_m},
          {"missing_share", last.missing_share},
          {"mapping_needed", last.is_needed}};
}

nlohmann::json point_of(const Eigen::Vector2d& point_m) {
  return nlohmann::json::array({point_m.x(), point_m.y()});
}

/// What the picture of a map needs.
nlohmann::json trace_of(const Variant& variant, const DriveScore& score) {
  nlohmann::json trace{{"part", name_of(variant.part)},
                       {"keeping", name_of(variant.keeping)},
                       {"drive", score.drive},
                       {"path_m", nlohmann::json::array()},
                       {"landmarks", nlohmann::json::array()},
                       {"trees", nlohmann::json::array()},
                       {"stack", nlohmann::json::array()}};
  for (const Eigen::Vector2d& place_m : score.map.path_m)
    trace["path_m"].push_back(point_of(place_m));
  for (const PlacedLandmark& one : score.map.landmarks)
    trace["landmarks"].push_back({{"at_m", point_of(one.world_m)},
                                  {"probability", one.probability},
                                  {"is_in_use", one.is_in_use}});
  for (const PlacedTree& tree : score.map.trees)
    trace["trees"].push_back(
        {{"at_m", point_of(tree.world_m)}, {"stands", tree.stands}, {"is_hidden", tree.is_hidden}});
  for (const sim::Box& box : score.map.stack)
    trace["stack"].push_back({{"at_m", point_of(box.centre_m.head<2>())},
                              {"half_size_m", point_of(box.half_size_m.head<2>())},
                              {"heading_rad", box.heading_rad}});
  return trace;
}

/// Whether the maps of a variant are drawn, of the first forest.
bool is_drawn(const Variant& variant) {
  return variant.part != Part::kFalseDetections && variant.keeping != Keeping::kNothing;
}

void print_drives(const nlohmann::json& rows) {
  fmt::print("{:<16} {:<18} {:>6} {:>5} {:>9} {:>7} {:>7} {:>14} {:>13} {:>14} {:>7} {:>8}\n",
             "part", "keeping", "false", "drive", "precision", "recall", "stored", "felled unused",
             "hidden unused", "wrongly unused", "ATE mm", "missing");
  for (const nlohmann::json& row : rows) {
    const auto n = [&](const char* key) { return row[key].get<double>(); };
    fmt::print(
        "{:<16} {:<18} {:>6.2f} {:>5.0f} {:>9.3f} {:>7.3f} {:>7.0f} {:>8.0f} of {:<3.0f} "
        "{:>6.0f} of {:<3.0f} {:>14.0f} {:>7.1f} {:>8.2f}\n",
        row["part"].get<std::string>(), row["keeping"].get<std::string>(), n("false_share"),
        n("drive"), n("right") / std::max(1.0, n("in_use")),
        n("found") / std::max(1.0, n("standing")), n("stored"), n("felled_unused"), n("felled"),
        n("hidden_unused"), n("hidden"), n("wrongly_unused"), 1e3 * n("ate_m"), n("missing_share"));
  }
}

void write_drives(const DrivesCommand& options, const nlohmann::json& rows,
                  const nlohmann::json& traces) {
  const nlohmann::json config{{"seed", options.seed},
                              {"runs", options.runs},
                              {"drives", options.drives.forest.drives},
                              {"share", options.drives.forest.share},
                              {"length_m", options.drives.forest.course.length_m},
                              {"stack_m", options.drives.stack_m}};
  harness::write_json(options.json, harness::result_document("existence-drives", config, rows));
  const std::filesystem::path maps = harness::traces_file(options.json);
  harness::write_json(maps, traces);
  harness::plot("existence_drives.py", {options.json, maps.string()});
}

void run_drives(const DrivesCommand& options) {
  const auto& stop = terminal::catch_interrupts();
  const std::vector<Variant> variants = variants_of(options.part);
  std::vector<nlohmann::json> results(variants.size() * static_cast<std::size_t>(options.runs));
  std::vector<nlohmann::json> traces(variants.size(), nlohmann::json::array());
  tools::run_in_parallel(results.size(), options.jobs, "drives", stop, [&](std::size_t i) {
    const Variant& variant = variants[i % variants.size()];
    const std::uint64_t seed =
        harness::run_seed(options.seed, static_cast<int>(i / variants.size()));
    const auto forest = forest_for(variant.part, options.drives, seed);
    const harness::MapFolder folder(fmt::format("existence-drives-{}", i));
    nlohmann::json rows = nlohmann::json::array();
    for (const DriveScore& score :
         drive_forest(forest, options.drives, variant, seed, folder.path(),
                      [](double) { terminal::throw_if_interrupted(); })) {
      rows.push_back(row_of(seed, variant, score));
      if (i < variants.size() && is_drawn(variant)) traces[i].push_back(trace_of(variant, score));
    }
    results[i] = std::move(rows);
  });

  nlohmann::json rows = nlohmann::json::array();
  for (const nlohmann::json& one : results)
    for (const nlohmann::json& row : one) rows.push_back(row);
  print_drives(rows);
  if (options.json.empty()) return;
  nlohmann::json maps = nlohmann::json::array();
  for (const nlohmann::json& one : traces)
    for (const nlohmann::json& map : one) maps.push_back(map);
  write_drives(options, rows, maps);
}

}  // namespace

void add_changing_forest_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "existence-drives",
      "A forest mapped once and driven again while trees go and come, from raw LIDAR");
  const auto options = std::make_shared<DrivesCommand>();
  options->drives.forest.course.length_m = 150.0;
  command.add_option("--part", options->part, "Part of the experiment, or all")
      ->check(CLI::IsMember({"all", "changes", "stack", "false detections"}))
      ->capture_default_str();
  add_number(command, "--runs", options->runs, 1, 1000, "Forests, each with every part");
  command.add_option("--seed", options->seed, "Seed of the first forest")->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Runs side by side");
  add_number(command, "--drives", options->drives.forest.drives, 2, 100,
             "Drives; the first one maps");
  add_number(command, "--share", options->drives.forest.share, 0.0, 0.9,
             "Share of the trees felled between two drives");
  add_number(command, "--length-m", options->drives.forest.course.length_m, 30.0, 10000.0,
             "Length of the path [m]");
  command.add_option("--config", options->drives.config_dir, "Configuration folder of the chain")
      ->capture_default_str();
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("existence-drives", [&] { run_drives(*options); }); });
}

}  // namespace understory::eval::experiments::changing_forest
