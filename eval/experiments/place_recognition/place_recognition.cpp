#include "eval/experiments/place_recognition/place_recognition.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/io/stem_frames.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/place_recognition/protocol.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::place_recognition {
namespace {

using StemParameters = understory::place_recognition::StemRecogniserParameters;

struct PlaceOptions {
  std::vector<std::string> drives;
  std::vector<std::string> maps;
  std::vector<std::string> protocols;
  std::size_t window = 6;
  int jobs = 1;
  std::string json;
};

struct NamedProtocol {
  const char* name;
  bool is_between;
  Protocol protocol;
};
constexpr std::array kProtocols{NamedProtocol{"within-50-frames", false, {5.0, 50, 0.0}},
                                NamedProtocol{"within-300-s", false, {5.0, 1, 300.0}},
                                NamedProtocol{"between-3-m", true, {3.0, 0, 0.0}},
                                NamedProtocol{"between-5-m", true, {5.0, 0, 0.0}}};

std::vector<NamedProtocol> protocols_of(const PlaceOptions& options) {
  std::vector<NamedProtocol> chosen;
  for (const NamedProtocol& one : kProtocols) {
    const bool is_named = std::find(options.protocols.begin(), options.protocols.end(), one.name) !=
                          options.protocols.end();
    const bool is_usual = options.protocols.empty() && one.is_between != options.maps.empty() &&
                          one.protocol.seconds_earlier == 0.0;
    if (is_named || is_usual) chosen.push_back(one);
  }
  for (const NamedProtocol& one : chosen) {
    if (one.is_between && options.maps.empty())
      throw std::runtime_error(fmt::format("--protocol {}: no --map is given", one.name));
  }
  return chosen;
}

StemDrive load_drive(const std::string& folder) {
  std::filesystem::path path(folder);
  if (path.filename().empty()) path = path.parent_path();
  return levelled(path.filename().string(), io::read_stem_frames(folder));
}

std::vector<StemDrive> load_drives(const std::vector<std::string>& folders) {
  std::vector<StemDrive> drives;
  drives.reserve(folders.size());
  for (const std::string& folder : folders) drives.push_back(load_drive(folder));
  return drives;
}

/// What the rows share: which protocol on which drives, with what.
struct PlaceCell {
  const char* protocol;
  std::string query;
  std::string map;
  std::size_t frames_per_query;
  bool with_diameters;
};

nlohmann::json measures_of(const Trials& result) {
  std::vector<double> error_m, residual_m, ms;
  for (const Trial& trial : result.trials) {
    ms.push_back(trial.ms);
    if (!trial.is_right) continue;
    error_m.push_back(trial.error_m);
    residual_m.insert(residual_m.end(), trial.residual_m.begin(), trial.residual_m.end());
  }
  return {{"error_m_p50", tools::quantile(error_m, 0.5)},
          {"stem_residual_m_p50", tools::quantile(residual_m, 0.5)},
          {"ms_p50", tools::quantile(ms, 0.5)},
          {"ms_p99", tools::quantile(ms, 0.99)},
          {"bytes_per_frame", result.stored_bytes_per_frame}};
}

nlohmann::json row_of_places(const PlaceCell& cell, const Trials& result) {
  const PlaceScore score = score_of(result.trials);
  nlohmann::json row = measures_of(result);
  row.update({{"protocol", cell.protocol},
              {"drive", cell.query},
              {"map", cell.map},
              {"frames_per_query", cell.frames_per_query},
              {"with_diameters", cell.with_diameters},
              {"queries", score.queries},
              {"queries_without_match", score.queries_without_match},
              {"recall_at_1", score.recall_at_1},
              {"max_f1", score.max_f1},
              {"recall_zero_wrong", score.recall_zero_wrong},
              {"recall_accepted", score.recall_accepted},
              {"wrong_accepted", score.wrong_accepted},
              {"wrong_accepted_no_match", score.wrong_accepted_no_match}});
  if (score.queries_without_match > 0)
    row["wrong_bound_95_pct"] = 3.0 / static_cast<double>(score.queries_without_match);
  return row;
}

void print_place_heading() {
  fmt::print(
      "{:<17} {:<12} {:<12} {:>3} {:>5} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>5} {:>7} {:>7} "
      "{:>6} {:>5}\n",
      "protocol", "drive", "map", "win", "dbh", "match", "none", "r@1", "F1", "r@0", "acc.",
      "wrong", "pose m", "stem m", "ms", "B/fr");
}

void print_place_row(const nlohmann::json& row) {
  const auto n = [&](const char* key) { return row[key].get<std::size_t>(); };
  const auto x = [&](const char* key) { return row[key].get<double>(); };
  fmt::print(
      "{:<17} {:<12} {:<12} {:>3} {:>5} {:>6} {:>6} {:>6.3f} {:>6.3f} {:>6.3f} {:>6.3f} {:>5} "
      "{:>7.3f} {:>7.3f} {:>6.1f} {:>5.0f}\n",
      row["protocol"].get<std::string>(), row["drive"].get<std::string>(),
      row["map"].get<std::string>(), n("frames_per_query"),
      row["with_diameters"].get<bool>() ? "yes" : "no", n("queries"), n("queries_without_match"),
      x("recall_at_1"), x("max_f1"), x("recall_zero_wrong"), x("recall_accepted"),
      n("wrong_accepted"), x("error_m_p50"), x("stem_residual_m_p50"), x("ms_p50"),
      x("bytes_per_frame"));
  std::fflush(stdout);
}

/// Rows of one protocol on one pair of drives: with diameters and without.
void run_pair(const NamedProtocol& protocol, const StemDrive& queries, const StemDrive& map,
              std::size_t window, const PlaceOptions& options, const std::atomic<bool>& stop,
              nlohmann::json& rows) {
  for (const bool with_diameters : {true, false}) {
    StemParameters parameters;
    parameters.noise.use_diameters = with_diameters;
    parameters.radius_m = protocol.protocol.radius_m;
    const auto seen = [&](const StemDrive& drive) {
      return window > 1 ? windowed(drive, window, parameters) : drive;
    };
    const Trials trials =
        protocol.is_between
            ? between_drives(seen(queries), seen(map), protocol.protocol, parameters, options.jobs,
                             stop)
            : within_drive(seen(queries), protocol.protocol, parameters, options.jobs, stop);
    rows.push_back(
        row_of_places({protocol.name, queries.name, protocol.is_between ? map.name : queries.name,
                       std::max<std::size_t>(1, window), with_diameters},
                      trials));
    print_place_row(rows.back());
  }
}

/// Their names, without where this machine has them.
std::vector<std::string> names_of(const std::vector<StemDrive>& drives) {
  std::vector<std::string> names;
  names.reserve(drives.size());
  for (const StemDrive& drive : drives) names.push_back(drive.name);
  return names;
}

void run_places(const PlaceOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  const auto protocols = protocols_of(options);
  const std::vector<StemDrive> drives = load_drives(options.drives);
  const std::vector<StemDrive> maps = load_drives(options.maps);

  nlohmann::json rows = nlohmann::json::array();
  print_place_heading();
  for (const NamedProtocol& protocol : protocols) {
    for (const std::size_t window : std::set<std::size_t>{1, options.window}) {
      for (const StemDrive& queries : drives) {
        if (!protocol.is_between) run_pair(protocol, queries, queries, window, options, stop, rows);
        for (std::size_t i = 0; protocol.is_between && i < maps.size(); ++i)
          run_pair(protocol, queries, maps[i], window, options, stop, rows);
      }
    }
  }
  fmt::print(
      "match: queries with a frame within the radius; none: all others. acc.: right and accepted "
      "({} decades), of the former; wrong: accepted, of all.\n",
      kAcceptDecades);
  if (options.json.empty()) return;
  const nlohmann::json config{{"drives", names_of(drives)},
                              {"maps", names_of(maps)},
                              {"window", options.window},
                              {"accept_decades", kAcceptDecades}};
  harness::write_json(options.json, harness::result_document("place-recognition", config, rows));
}

}  // namespace

void add_place_recognition_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "place-recognition", "Frames of stems found again, within a drive and between drives");
  const auto options = std::make_shared<PlaceOptions>();
  command
      .add_option("drives", options->drives,
                  "Folders with frame_<n>.csv and trajectory.txt: the queries")
      ->required();
  command.add_option("--map", options->maps,
                     "Folders of other drives: the queries are looked for in each of them");
  std::vector<std::string> names;
  names.reserve(kProtocols.size());
  for (const NamedProtocol& one : kProtocols) names.emplace_back(one.name);
  command
      .add_option("--protocol", options->protocols,
                  "within-50-frames (without --map), within-300-s, between-3-m and between-5-m "
                  "(with --map)")
      ->check(CLI::IsMember(names));
  add_number(command, "--window", options->window, 1, 50,
             "Second set of rows: this many frames as one, aligned by their stems; 1 = none");
  add_number(command, "--jobs", options->jobs, 1, 256, "Queries side by side");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("place-recognition", [&] { run_places(*options); }); });
}

}  // namespace understory::eval::experiments::place_recognition
