// `understory eval victoria-park`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/victoria_park/victoria_park_report.hpp"
#include "eval/harness/results.hpp"

namespace understory::eval::experiments::victoria_park {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string data;
  std::string json;
  bool plots = true;
};

/// --data, else UNDERSTORY_DATA, else beside the checkout.
fs::path data_folder(const Options& options) {
  if (!options.data.empty()) return options.data;
  const char* const root = std::getenv("UNDERSTORY_DATA");
  return root != nullptr ? fs::path(root) : fs::path("../shared/data");
}

/// The folder with all sets, or the recording itself.
struct Sources {
  fs::path recording;
  fs::path curated;
  fs::path batch;
};

Sources find_sources(const fs::path& data) {
  if (!fs::exists(data / "victoria_park_raw")) return {data, {}, {}};
  const fs::path raw = data / "victoria_park_raw";
  return {raw / "victoria_park_ascii.zip", raw / "tree_observations_associated_uts.csv",
          data / "victoria_park_landmark" / "reference_poses_computed.csv"};
}

void write_results(const Options& options, const VictoriaParkReport& report) {
  nlohmann::json details = to_json(report);
  nlohmann::json rows = details["rows"];
  harness::write_json(options.json,
                      harness::result_document("victoria-park", nlohmann::json::object(), rows));
  harness::write_json(harness::traces_file(options.json), details);
  if (options.plots) {
    harness::plot("victoria_park.py", {options.json, harness::traces_file(options.json).string()});
  }
}

void run(const Options& options) {
  const auto& stop = terminal::catch_interrupts();
  const Sources sources = find_sources(data_folder(options));
  const io::VictoriaPark recording = io::read_victoria_park(sources.recording);

  VictoriaParkConfig config = victoria_park_defaults();
  VictoriaParkRun driven = [&] {
    terminal::Progress progress("victoria-park", static_cast<double>(recording.scans.size()),
                                terminal::Progress::Without::kSeconds);
    return drive_victoria_park(recording, config, [&] {
      if (stop) throw std::runtime_error("interrupted");
      progress.advance();
    });
  }();

  std::vector<metrics::CuratedObservation> curated;
  std::vector<metrics::StampedPose> batch;
  if (fs::exists(sources.curated)) curated = metrics::read_curated_observations(sources.curated);
  if (fs::exists(sources.batch)) {
    batch = read_batch_solution(sources.batch, driven.dead_reckoned);
  }

  const VictoriaParkReport report = assess(std::move(driven), recording, curated, batch);
  print(report);
  if (!options.json.empty()) write_results(options, report);
}

}  // namespace

void add_victoria_park_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "victoria-park", "A real drive: recorded laser and wheels to a map, against GPS and trees");
  auto options = std::make_shared<Options>();
  command->add_option("--data", options->data,
                      "Folder with victoria_park_raw, or the recording itself (zip or folder); "
                      "default $UNDERSTORY_DATA");
  command->add_option("--json", options->json, "Results; traces and plots go beside it");
  command->add_flag("!--no-plots", options->plots, "No plots");
  command->callback([options] { run_guarded("victoria-park", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::victoria_park
