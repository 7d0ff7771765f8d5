// `understory report`: a drive as one HTML file, drawn by the Python package.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/terminal/run_program.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/paths.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;

/// Debian's interpreter: it has numpy and matplotlib.
constexpr const char* kPython = "/usr/bin/python3";

struct ReportOptions {
  std::string log;
  std::string out;
};

/// Folder of the package `understory`: beside a build or an installation.
std::optional<fs::path> python_folder() {
  const fs::path above = executable_directory().parent_path();
  for (const char* const folder : {"python", "lib/python3/dist-packages"}) {
    if (fs::exists(above / folder / "understory" / "report.py")) return above / folder;
  }
  return std::nullopt;
}

void run_report(ReportOptions options) {
  const auto folder = python_folder();
  if (!folder) fail("report: the Python package of understory is not beside this program");
  if (!fs::exists(kPython))
    fail(fmt::format("report: no {} (apt-get install python3-matplotlib)", kPython));
  if (options.out.empty()) options.out = fs::path(options.log).replace_extension(".html").string();

  if (fs::is_directory(options.out)) wrong_usage("--out: " + options.out + " is a folder");
  constexpr const char* kProgram =
      "import sys; sys.path.insert(0, sys.argv.pop(1)); from understory.report import main; main()";
  refuse_to_overwrite(options.log, options.out);
  const int status =
      terminal::run_program({kPython, "-c", kProgram, folder->string(), options.log, options.out});
  if (status != 0) fail(fmt::format("report: {} was not made", options.out));
  fmt::print("{}\n", options.out);
}

}  // namespace

void add_report_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "report", "A drive as one HTML file: map, errors, health, times, channels");
  const auto options = std::make_shared<ReportOptions>();
  command->add_option("log", options->log, "An LCM log with the mapper's output")->required();
  command->add_option("--out", options->out, "The file (default: the log's name with .html)");
  command->callback([options] { run_report(*options); });
}

}  // namespace understory::cli
