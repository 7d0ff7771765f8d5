// `understory export`: the results in a log in formats of other tools.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/io/data_error.hpp"
#include "common/reference_system/reference_system.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/frame_check.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/mcap_export.hpp"
#include "deploy/cli/slam_results.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

struct ExportOptions {
  std::string log;
  std::filesystem::path out;
  std::vector<std::string> formats{"tum", "csv", "g2o"};
  std::string frame_of;  ///< A map file with the frame of the drive.
  bool force = false;    ///< Export even if landmarks do not confirm the frame.
};

SlamResults read_results(const std::string& log) {
  SlamResults results;
  io::LcmLogReader reader(log);
  terminal::Progress progress("reading " + log, static_cast<double>(reader.size_bytes()));
  while (const auto event = reader.next()) {
    terminal::throw_if_interrupted();
    results.add(*event);
    progress.update(static_cast<double>(reader.position_bytes()));
  }
  reader.refuse_other_files();
  return results;
}

void write(const std::filesystem::path& file, const std::string& text) {
  write_text_file(file, text);
  fmt::print("{}\n", file.string());
}

/// The map of a drive as GeoJSON, at the location of the map with which it began.
void export_geojson(const SlamResults& results, const model::MapReference& reference,
                    const std::filesystem::path& out) {
  const model::WholeMap map = results.map.whole().value();
  map_file::StoredMap stored;
  stored.keyframes = map.keyframes;
  for (const model::MapLandmark& landmark : map.landmarks) {
    map_file::StoredLandmark& one = stored.landmarks.emplace_back();
    one.landmark = landmark;
    const auto told = results.existence.find(landmark.id);
    if (told != results.existence.end()) one.existence = told->second.probability;
  }
  for (const auto& [layer, text] : map_geojson(stored, reference))
    write(out / (layer + ".geojson"), text);
}

/// Location of a drive's frame, from the map with which it began.
model::MapReference frame_of_drive(const ExportOptions& options) {
  if (options.frame_of.empty())
    fail(
        fmt::format("{}: the map in a log is not georeferenced: --frame-of MAP.gpkg names the map "
                    "that the drive "
                    "began with; or use `understory map import` and `map georeference`",
                    options.log));
  const auto reference = map_file::MapFile(options.frame_of, map_file::Access::kRead).reference();
  if (!reference) fail(place_missing(options.frame_of));
  return *reference;
}

/// Checks the frame by the landmarks of the drive's map.
void check_frame(const ExportOptions& options, const SlamResults& results) {
  const map_file::MapFile file(options.frame_of, map_file::Access::kRead);
  require_one_frame({options.log, {results.map.whole().value().landmarks}}, maps_in(file));
}

void export_as(const std::string& format, const SlamResults& results,
               const std::filesystem::path& out) {
  const model::WholeMap map = results.map.whole().value();
  if (format == "tum") {
    write(out / "live.tum", to_tum(live_trajectory(results)));
    write(out / "keyframes.tum", to_tum(keyframe_trajectory(map)));
    if (!results.truth.empty()) write(out / "truth.tum", to_tum(results.truth));
  } else if (format == "kitti") {
    const PairedTrajectories paired = paired_trajectories(results);
    write(out / "live.kitti", to_kitti(paired.live));
    if (!paired.truth.empty()) write(out / "truth.kitti", to_kitti(paired.truth));
  } else if (format == "csv") {
    write(out / "landmarks.csv", landmarks_csv(map, results.existence));
    write(out / "keyframes.csv", keyframes_csv(map));
  } else {
    write(out / "graph.g2o", to_g2o(results));
  }
}

void export_results(const ExportOptions& options) {
  const std::string& log = options.log;
  const std::filesystem::path& out = options.out;
  const bool has_places = std::ranges::find(options.formats, "geojson") != options.formats.end();
  std::optional<model::MapReference> reference;
  if (has_places) reference = frame_of_drive(options);

  const auto results = read_results(log);
  if (!results.map.map()) {
    fail(fmt::format("{}: neither a whole MAP nor the start of one in it (run replay first)", log));
  }
  if (results.map.missed() > 0) {
    fmt::print(stderr, "{}: {} changes of the map are missing: some landmarks may be old\n", log,
               results.map.missed());
  }
  if (has_places && !options.force) check_frame(options, results);
  std::filesystem::create_directories(out);
  for (const auto& format : options.formats)
    format == "geojson" ? export_geojson(results, *reference, out)
                        : export_as(format, results, out);
}

/// Streams the log: it may have any length and needs no map.
void export_messages(const std::string& log, const std::filesystem::path& out) {
  const std::filesystem::path file = mcap_path(log, out);
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  const McapSummary summary = export_mcap(log, file);
  if (summary.refused > 0) {
    fmt::print(stderr, "{}: {} messages are not what their channel says and were left out\n", log,
               summary.refused);
  }
  if (summary.landmarks_left_out > 0) {
    fmt::print(stderr, "{}: {} landmarks beyond the first 200,000 were left out\n", log,
               summary.landmarks_left_out);
  }
  fmt::print("{}\n", file.string());
}

void export_all(ExportOptions options) {
  const bool has_messages = std::erase(options.formats, "mcap") > 0;
  if (options.out.extension() == ".mcap" && !options.formats.empty()) {
    wrong_usage("--out: several formats need a directory");
  }
  if (has_messages) export_messages(options.log, options.out);
  if (!options.formats.empty()) export_results(options);
}

void run(const ExportOptions& options) {
  terminal::catch_interrupts();
  try {
    export_all(options);
  } catch (const io::LogError& error) {
    fail(error.what());
  } catch (const io::DataError& error) {
    fail(error.what());
  } catch (const map_file::MapFileError& error) {
    fail(error.what());
  } catch (const reference_system::ReferenceError& error) {
    fail(error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    fail(fmt::format("{}: {}", options.out.string(), error.code().message()));
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("{}: {}", options.log, error.what()));
  }
}

}  // namespace

void add_export_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("export", "Results in formats that other tools read");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("log", options->log, "An LCM log with the mapper's output")->required();
  command
      ->add_option("--out", options->out, "Directory for the files; for mcap also a file NAME.mcap")
      ->required();

  command
      ->add_option(
          "--format", options->formats,
          "tum, kitti, csv, g2o: results; geojson: the map by longitude and latitude (needs "
          "--frame-of); mcap: all messages, for Foxglove and Lichtblick")
      ->delimiter(',')
      ->check(CLI::IsMember({"tum", "kitti", "csv", "g2o", "geojson", "mcap"}))
      ->capture_default_str();
  command->add_option("--frame-of", options->frame_of,
                      "For geojson: the georeferenced map file with which the drive began; the "
                      "landmarks must agree");
  command->add_flag("--force", options->force, "Use --frame-of even if the landmarks do not agree");
  command->callback([options] { run(*options); });
}

}  // namespace understory::cli
