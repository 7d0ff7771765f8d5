// `understory launch`: starts the processes, restarts those that die, stops them cleanly.
#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <memory>
#include <optional>
#include <regex>

#include "common/bus/bulk_group.hpp"
#include "common/bus/device.hpp"
#include "common/bus/launch_config.hpp"
#include "common/bus/live_bus.hpp"
#include "common/bus/parameter_table.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/given_map_option.hpp"
#include "deploy/cli/health_listener.hpp"
#include "deploy/cli/launch_report.hpp"
#include "deploy/cli/launch_voice.hpp"
#include "deploy/cli/paths.hpp"
#include "deploy/launch/registry.hpp"
#include "deploy/launch/supervisor.hpp"

namespace understory::cli {
namespace {

using launch::Clock;

struct LaunchOptions {
  std::filesystem::path config = default_config_directory();
  std::filesystem::path state = default_state_directory();
  std::filesystem::path report;
  std::string lcm_url;
  std::vector<std::string> only;
  bool fresh = false;
  bool quiet = false;
  bool is_open_bus = false;
  GivenMapOptions map;
};

/// SIGTERM, SIGINT and SIGHUP as a descriptor, so that they are handled between steps.
class StopSignals {
 public:
  StopSignals() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, number);
    ::sigprocmask(SIG_BLOCK, &signals, nullptr);
    descriptor_ = ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~StopSignals() { ::close(descriptor_); }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  int descriptor() const { return descriptor_; }
  bool received() const {
    signalfd_siginfo info{};
    return ::read(descriptor_, &info, sizeof info) == static_cast<ssize_t>(sizeof info);
  }

 private:
  int descriptor_ = -1;
};

bool selected(const LaunchOptions& options, const std::string& name) {
  return options.only.empty() ||
         std::find(options.only.begin(), options.only.end(), name) != options.only.end();
}

/// The processes to run.
std::vector<bus::ProcessEntry> chosen_processes(const LaunchOptions& options) {
  auto entries = bus::read_launch_config(options.config).processes;
  std::erase_if(entries, [&](const auto& entry) { return !selected(options, entry.name); });
  if (entries.empty()) wrong_usage("launch: --only names none of the processes in launch.toml");
  return entries;
}

/// The file of a process's parameters; empty = defaults.
std::filesystem::path config_of(const LaunchOptions& options, const bus::ProcessEntry& entry) {
  const bool has_layer =
      options.map.is_given() && (entry.name == kMapperProcess || entry.name == kTrackerProcess);
  return has_layer ? layer_file(options.state / entry.name) : entry.config;
}

std::vector<launch::ProcessSpec> process_specs(const LaunchOptions& options,
                                               const std::vector<bus::ProcessEntry>& entries) {
  std::vector<launch::ProcessSpec> specs;
  for (const auto& entry : entries) {
    launch::ProcessSpec spec;
    spec.name = entry.name;
    spec.sends_health = entry.is_service;
    spec.ends_last = entry.ends_last;
    spec.command.executable = find_executable(entry.executable);

    if (const auto config = config_of(options, entry); !config.empty()) {
      spec.command.arguments.insert(spec.command.arguments.end(), {"--config", config.string()});
    }

    if (entry.keeps_state) {
      spec.command.arguments.insert(spec.command.arguments.end(),
                                    {"--state-dir", (options.state / entry.name).string()});
    }

    spec.command.arguments.insert(spec.command.arguments.end(), entry.arguments.begin(),
                                  entry.arguments.end());
    if (!options.lcm_url.empty()) {
      spec.command.environment.push_back("LCM_DEFAULT_URL=" + options.lcm_url);
    }
    if (options.is_open_bus) spec.command.environment.emplace_back("UNDERSTORY_OPEN_BUS=1");

    specs.push_back(std::move(spec));
  }

  return specs;
}

/// Whether the name is that of a saved state.
bool is_state_file(const std::filesystem::directory_entry& entry) {
  static const std::regex pattern(
      R"([A-Za-z0-9_-]+\.(snapshot|journal\.[0-9]+|recovering)(\.new)?(\.damaged)?|given_map\.toml)");
  const std::string name = entry.path().filename().string();
  return std::regex_match(name, pattern) && (entry.is_symlink() || !entry.is_directory());
}

/// Deletes only saved state, because the folder may be a link to one with other files.
void forget_state(const std::filesystem::path& folder, LaunchReport& report) {
  if (!std::filesystem::exists(folder)) return;
  std::vector<std::filesystem::path> gone;
  std::size_t others = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto name = entry.path().filename();
    if (is_state_file(entry)) {
      gone.push_back(entry.path());
    } else if (name != bus::kKeptFolder && name.extension() != ".lock") {
      ++others;
    }
  }

  for (const auto& one : gone) std::filesystem::remove(one);
  if (others == 0) return;
  report.add("launch", fmt::format("--fresh: {}: {} files that are no saved state stay there",
                                   folder.string(), others));
}

/// Makes a directory for each process's state. Call it only under the lock, because others may use
/// them, and after joining the bus, so that a launch that cannot run deletes nothing. If a
/// directory cannot be made, its process reports this in HEALTH. Throws
/// std::filesystem::filesystem_error where --fresh cannot delete a state, which would otherwise be
/// used.
void prepare_state(const LaunchOptions& options, const launch::Supervisor& supervisor,
                   LaunchReport& report) {
  for (const auto& process : supervisor.status()) {
    if (options.fresh) forget_state(options.state / process.name, report);
    std::error_code ignored;
    std::filesystem::create_directories(options.state / process.name, ignored);
  }
}

/// Writes the layer files of the processes that receive the map, or deletes those of an earlier
/// launch.
void prepare_map(const LaunchOptions& options, const std::vector<bus::ProcessEntry>& entries,
                 const std::optional<GivenMapLayers>& given) {
  for (const bus::ProcessEntry& entry : entries) {
    if (entry.name != kMapperProcess && entry.name != kTrackerProcess) continue;
    const std::filesystem::path folder = options.state / entry.name;
    if (given) {
      keep_layer(folder, entry.config, given->layers.at(entry.name), given->checksum);
    } else {
      std::error_code ignored;  // A file that remains is not read.
      std::filesystem::remove(layer_file(folder), ignored);
    }
  }
}

/// The layers with an absolute path of the map; none without a given map.
std::optional<GivenMapLayers> map_layer(const LaunchOptions& options,
                                        const std::vector<bus::ProcessEntry>& entries) {
  if (!options.map.is_given()) return std::nullopt;
  std::vector<std::string> names;
  names.reserve(entries.size());
  for (const bus::ProcessEntry& entry : entries) names.push_back(entry.name);
  return given_map_layers(options.map, std::filesystem::absolute(options.map.file), names);
}

/// Sleeps until a process ends, a signal or a message arrives, or a step is due.
void wait(const launch::Supervisor& supervisor, const StopSignals& signals,
          const HealthListener& health) {
  std::vector<pollfd> polled{{signals.descriptor(), POLLIN, 0}, {health.descriptor(), POLLIN, 0}};
  for (const int descriptor : supervisor.descriptors()) polled.push_back({descriptor, POLLIN, 0});
  const auto now = Clock::now();
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(supervisor.wake_up(now) - now).count();
  ::poll(polled.data(), polled.size(), static_cast<int>(std::clamp<long>(left, 0, 1000)));
}

/// Heartbeats distinguish a hang from work. Throws BusError, because on an unusable bus the
/// processes would receive nothing either.
HealthListener listen(const LaunchOptions& options, launch::Supervisor& supervisor,
                      LaunchReport& report) {
  return HealthListener(options.lcm_url, [&](const health_t& message) {
    if (message.pid > 0) report.add(message);  // Messages with pid 0 are our own.
    supervisor.heartbeat(message.process, static_cast<pid_t>(message.pid), Clock::now());
  });
}

/// Checks the sweeps' own group at the start, not at the first sweep. Throws BusError where another
/// program has its port exclusively.
void check_group_of_sweeps(const std::string& lcm_url) {
  const std::string url = bus::complete_lcm_url(lcm_url);
  const std::string sweeps = bus::bulk_lcm_url(url);
  if (sweeps == url) return;
  bus::LiveBus(sweeps).subscribe("LAUNCH_LOOKS", 1, [](const bus::BusMessage&) {});
}

void run(launch::Supervisor& supervisor, launch::Registry& registry, const StopSignals& signals,
         HealthListener& health, LaunchVoice& voice, LaunchReport& report) {
  std::vector<pid_t> noted;
  while (!supervisor.stopped()) {
    const auto now = Clock::now();
    if (signals.received() && !supervisor.stopping()) {
      report.add("launch", "stopping");
      supervisor.stop(now);
    }

    if (!supervisor.refused().empty()) supervisor.stop(now);
    supervisor.step(now);
    voice.tell(supervisor.status(), now);
    std::vector<pid_t> pids;
    for (const auto& process : supervisor.status()) pids.push_back(process.pid);

    if (pids != noted) {
      registry.write(supervisor.status());
      noted = std::move(pids);
    }

    if (supervisor.stopped())
      break;  // The note is empty now, so the next launch starts from the beginning.
    wait(supervisor, signals, health);
    while (health.handle(std::chrono::milliseconds(0))) {
    }
  }
}

void launch_processes(const LaunchOptions& options) {
  std::vector<bus::ProcessEntry> entries;
  try {
    entries = chosen_processes(options);
  } catch (const bus::ConfigurationError& error) {
    wrong_usage(error.what());
  }

  if (!options.is_open_bus) bus::require_closed_bus(options.lcm_url);
  const std::optional<GivenMapLayers> layer = map_layer(options, entries);
  const StopSignals signals;
  launch::Registry registry(options.state);
  LaunchReport report(options.quiet);
  launch::Supervisor supervisor(
      process_specs(options, entries), {},
      [&](const std::string& process, const std::string& text) { report.add(process, text); });
  HealthListener health = listen(options, supervisor, report);
  check_group_of_sweeps(options.lcm_url);
  LaunchVoice voice(options.lcm_url);
  if (const std::string& trouble = registry.trouble(); !trouble.empty()) {
    report.add("launch", "drives without saved state: " + trouble);
    voice.warn("state_not_kept", trouble);
  }
  prepare_state(options, supervisor, report);
  prepare_map(options, entries, layer);
  supervisor.start(registry.read(), Clock::now());
  run(supervisor, registry, signals, health, voice, report);

  if (!options.report.empty()) report.write(options.report, supervisor.status());
  if (!supervisor.refused().empty()) {
    wrong_usage(fmt::format("launch: {}: refused to start", supervisor.refused().front()));
  }
  for (const auto& process : supervisor.status()) {
    if (process.state != launch::ProcessState::kGivenUp) continue;
    fail(fmt::format("launch: {}: given up: {}", process.name, process.last_ending));
  }
}

}  // namespace

void add_launch_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "launch", "Starts the processes, restarts one that dies, stops them cleanly");
  auto options = std::make_shared<LaunchOptions>();
  command->add_option("--config", options->config, "Directory with launch.toml and one file each")
      ->capture_default_str();
  command->add_option("--state-dir", options->state, "Directory of the processes' state")
      ->capture_default_str();
  command->add_option("--lcm-url", options->lcm_url, "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  command->add_option("--report", options->report, "Write what happened to this JSON file");
  command->add_option("--only", options->only, "Only these processes")->delimiter(',');

  add_given_map_options(*command, options->map);
  command->add_flag("--fresh", options->fresh,
                    "Forget the state of earlier runs first; maps of drives stay");
  command->add_flag("--open-bus", options->is_open_bus,
                    "Allow a TTL above 0: other computers hear the bus and can send to it");
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  command->callback([options] { launch_processes(*options); });
}

}  // namespace understory::cli
