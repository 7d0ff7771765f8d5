// `understory export`: the results in a log in formats that other tools read.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/slam_results.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

struct ExportOptions {
  std::string log;
  std::filesystem::path out;
  std::vector<std::string> formats{"tum", "csv", "g2o"};
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

void export_as(const std::string& format, const SlamResults& results,
               const std::filesystem::path& out) {
  const model::WholeMap map = results.map.whole().value();
  if (format == "tum") {
    write(out / "live.tum", to_tum(live_trajectory(results)));
    write(out / "keyframes.tum", to_tum(keyframe_trajectory(map)));
    if (!results.truth.empty()) write(out / "truth.tum", to_tum(results.truth));
  } else if (format == "csv") {
    write(out / "landmarks.csv", landmarks_csv(map));
    write(out / "keyframes.csv", keyframes_csv(map));
  } else {
    write(out / "graph.g2o", to_g2o(results));
  }
}

void run(const ExportOptions& options) {
  terminal::catch_interrupts();
  try {
    const auto results = read_results(options.log);
    if (!results.map.map()) {
      fail(fmt::format("{}: neither a whole MAP nor the start of one in it (run replay first)",
                       options.log));
    }
    if (results.map.missed() > 0) {
      fmt::print(stderr, "{}: {} changes of the map are missing: some landmarks may be old\n",
                 options.log, results.map.missed());
    }
    std::filesystem::create_directories(options.out);
    for (const auto& format : options.formats) export_as(format, results, options.out);
  } catch (const io::LogError& error) {
    fail(error.what());
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("{}: {}", options.log, error.what()));
  }
}

}  // namespace

void add_export_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("export", "Results in formats that other tools read");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("log", options->log, "An LCM log with the mapper's output")->required();
  command->add_option("--out", options->out, "Directory for the files")->required();
  command->add_option("--format", options->formats, "tum, csv, g2o")
      ->delimiter(',')
      ->check(CLI::IsMember({"tum", "csv", "g2o"}))
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace understory::cli
