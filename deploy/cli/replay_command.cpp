// `understory replay`: runs a log through chosen stages in one process; the output has the same
// bytes every time.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "common/bus/launch_config.hpp"
#include "common/bus/replay.hpp"
#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/given_map_option.hpp"
#include "deploy/cli/paths.hpp"
#include "deploy/cli/services.hpp"

namespace understory::cli {
namespace {

struct ReplayOptions {
  std::string log;
  std::string out;
  std::vector<std::string> stages;
  std::filesystem::path config = default_config_directory();
  std::string channel_suffix;
  bool outputs_only = false;
  GivenMapOptions map;
};

bool reads_a_sensor(const std::string& name) {
  const auto services = sensor_services();
  return std::ranges::find(services, name, &bus::Service::name) != services.end();
}

/// The processes launched by the configuration, so that a directory has the same effect live and
/// here, except other programs and those that read a sensor; both mapping stages without a
/// launch.toml.
std::vector<std::string> stages_of(const std::filesystem::path& config) {
  if (!std::filesystem::exists(config / "launch.toml")) return {"keyframer", "geoslam_mapper"};
  std::vector<std::string> names;
  try {
    for (auto& process : bus::read_launch_config(config).processes) {
      if (process.is_service && !reads_a_sensor(process.name))
        names.push_back(std::move(process.name));
    }
  } catch (const bus::ConfigurationError& error) {
    wrong_usage(error.what());
  }
  return names;
}

/// The named services, in the order of the data flow.
std::vector<bus::Service> chosen_services(const std::vector<std::string>& names) {
  std::vector<bus::Service> chosen;
  std::string known;
  for (const auto& name : names) {
    const auto services = all_services();
    const auto found =
        std::find_if(services.begin(), services.end(),
                     [&](const bus::Service& service) { return service.name == name; });
    if (found != services.end()) continue;
    for (const auto& service : services) known += " " + service.name;
    wrong_usage(fmt::format("--stages {}: no such stage; there are:{}", name, known));
  }

  for (const auto& service : all_services()) {
    if (std::find(names.begin(), names.end(), service.name) != names.end()) {
      chosen.push_back(service);
    }
  }

  return chosen;
}

bool interrupted() {
  try {
    terminal::throw_if_interrupted();
  } catch (const terminal::Interrupted&) {
    return true;
  }
  return false;
}

void print(const bus::ReplayReport& report, const ReplayOptions& options) {
  fmt::print("{} events read, {} fed to {} stages, {} messages derived -> {}\n", report.events,
             report.fed, report.health.size(), report.derived, options.out);
  if (report.damaged_places > 0) {
    fmt::print("the log is damaged: {} bytes skipped in {} places\n", report.damaged_bytes,
               report.damaged_places);
  }
  for (const auto& health : report.health) {
    for (const auto& reason : health.reasons) {
      fmt::print("{}: {} {} {}\n", health.process, terminal::printable(reason.channel),
                 terminal::printable(reason.reason), reason.count);
    }
  }
}

/// The path is not changed, so that the log has the same bytes on every computer.
void lay_map_over(const ReplayOptions& options, bus::ReplayOptions& replay) {
  if (!options.map.is_given()) return;
  std::vector<std::string> names;
  for (const bus::Service& service : replay.services) names.push_back(service.name);
  for (auto& [process, layer] : given_map_layers(options.map, options.map.file, names).layers)
    replay.layers[process] = std::move(layer);
}

void run(const ReplayOptions& options) {
  terminal::catch_interrupts();
  refuse_to_overwrite(options.log, options.out);
  if (!std::filesystem::is_directory(options.config))
    wrong_usage(fmt::format("--config: {}: no such folder", options.config.string()));
  bus::ReplayOptions replay_options;
  replay_options.log = options.log;
  replay_options.out = options.out;
  replay_options.services =
      chosen_services(options.stages.empty() ? stages_of(options.config) : options.stages);
  replay_options.config_dir = options.config;
  replay_options.channel_suffix = options.channel_suffix;
  replay_options.keeps_inputs = !options.outputs_only;
  lay_map_over(options, replay_options);
  terminal::Progress progress("replaying " + options.log, 1.0);
  replay_options.progress = [&](double part) {
    progress.update(part);
    return interrupted();
  };

  try {
    const auto report = replay(replay_options);
    if (report.was_stopped) fail(options.log + ": interrupted");
    print(report, options);
  } catch (const bus::ConfigurationError& error) {
    wrong_usage(error.what());
  } catch (const io::LogError& error) {
    fail(error.what());
  }
}

}  // namespace

void add_replay_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "replay", "Runs stages over a log in one process: the same bytes out every time");
  auto options = std::make_shared<ReplayOptions>();
  command->add_option("log", options->log, "An LCM log")->required();
  command->add_option("--out", options->out, "The new log")->required();
  command
      ->add_option("--stages", options->stages,
                   "Which stages; default: the processes of the configuration's launch.toml")
      ->delimiter(',');
  command
      ->add_option("--config", options->config,
                   "Directory with launch.toml and one file for each stage")
      ->capture_default_str();
  command->add_option("--channel-suffix", options->channel_suffix,
                      "Suffix of every output channel, e.g. _ALT");

  add_given_map_options(*command, options->map);
  command->add_flag("--outputs-only", options->outputs_only, "Leave the log's own events out");
  command->callback([options] { run(*options); });
}

}  // namespace understory::cli
