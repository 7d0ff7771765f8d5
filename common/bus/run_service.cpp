#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>

#include "common/bus/config_file.hpp"
#include "common/bus/device.hpp"
#include "common/bus/live_bus.hpp"
#include "common/bus/process_memory.hpp"
#include "common/bus/service.hpp"
#include "common/model/program_version.hpp"

namespace understory::bus {
namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr std::int64_t kHealthPeriodUs = 1000000;
/// A change of the state of HEALTH is published at most at this interval [us].
constexpr std::int64_t kHealthChangeUs = 100000;

struct Options {
  std::string config;
  std::string lcm_url;
  std::string state_dir;
  std::string channel_suffix;
  bool is_open_bus = false;
  bool prints_config = false;
};

/// SIGTERM and SIGINT as a descriptor for poll(). Blocked before any thread exists, so that
/// liblcm's threads inherit the mask; no handler, no global.
class StopSignal {
 public:
  StopSignal() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    file_ = ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~StopSignal() { ::close(file_); }
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  int file_descriptor() const { return file_; }
  bool has_come() {
    signalfd_siginfo info{};
    if (::read(file_, &info, sizeof(info)) == sizeof(info)) came_ = true;
    return came_;
  }

 private:
  int file_ = -1;
  bool came_ = false;
};

/// Publishes HEALTH once a second and when the state changes.
class HealthReporter {
 public:
  HealthReporter(Node& node, const Clock& clock) : node_(node), clock_(clock) {}
  void report_when_due() {
    const std::int64_t now = clock_.monotonic_us();
    const bool has_changed = node_.monitor().state() != reported_;
    if (now - reported_us_ < (has_changed ? kHealthChangeUs : kHealthPeriodUs)) return;
    publish();
  }
  void publish() {
    reported_us_ = clock_.monotonic_us();
    reported_ = node_.monitor().state();
    node_.publish_health();
  }
  int milliseconds_left() const {
    const std::int64_t left = reported_us_ + kHealthPeriodUs - clock_.monotonic_us();
    return static_cast<int>(std::clamp<std::int64_t>(left / 1000 + 1, 1, 1000));
  }

 private:
  Node& node_;
  const Clock& clock_;
  std::int64_t reported_us_ = -kHealthPeriodUs;
  std::int8_t reported_ = -1;
};

void run_until_stopped(HostedService& hosted, Bus& bus, StopSignal& stop, const Clock& clock) {
  Node& node = hosted.node();
  HealthReporter health(node, clock);
  auto* const device = dynamic_cast<Device*>(&hosted.adapter());
  std::vector<pollfd> files = {{bus.file_descriptor(), POLLIN, 0},
                               {stop.file_descriptor(), POLLIN, 0}};

  if (device != nullptr) {
    for (const int file : device->file_descriptors()) files.push_back({file, POLLIN, 0});
  }

  while (!stop.has_come()) {
    if (device != nullptr) device->attend(clock.monotonic_us());
    health.report_when_due();
    if (bus.handle_one(0)) continue;
    const int wait_ms = device != nullptr ? device->wait_ms() : health.milliseconds_left();
    ::poll(files.data(), files.size(), std::min(wait_ms, health.milliseconds_left()));
  }

  // finish() publishes numbered messages too, so the state is saved after it.
  hosted.adapter().finish();
  node.save_snapshot();
  node.monitor().stop();
  health.publish();
}

std::unique_ptr<HostedService> make_hosted(const Service& service, Bus& bus, const Clock& clock,
                                           const std::string& toml, const Options& options) {
  return std::make_unique<HostedService>(service, bus, clock, toml, options.config,
                                         [&](RuntimeParameters& runtime) {
                                           if (!options.channel_suffix.empty())
                                             runtime.channel_suffix = options.channel_suffix;
                                         });
}

/// The parameters, loaded and checked without a bus.
RuntimeParameters check_config(const Service& service, const std::string& toml,
                               const std::string& name, std::string* printed) {
  RuntimeParameters runtime;
  ParameterTable table;
  const std::unique_ptr<Adapter> adapter = service.make();
  describe(runtime, table);
  adapter->describe(table);
  table.load_text(toml, name);
  *printed = table.to_toml();
  return runtime;
}

/// The store of a process with --state-dir, after recovering `hosted` from it; null without.
std::unique_ptr<StateStore> recover_state(std::unique_ptr<HostedService>& hosted,
                                          const Service& service, Bus& bus, const Clock& clock,
                                          const std::string& toml, const Options& options) {
  if (options.state_dir.empty()) return nullptr;
  auto store =
      std::make_unique<StateStore>(options.state_dir, service.name, StateStore::Saving::kBeside);

  if (!hosted->node().recover(*store)) {
    // The stage may be partly loaded: make a new one.
    store->start_over();
    hosted = make_hosted(service, bus, clock, toml, options);
    hosted->node().tell_of_loss(*store);
    hosted->node().report(wire::Reason::kSnapshotDamaged,
                          "the state cannot be used; starting fresh");
  }
  hosted->node().journal_to(store.get());
  return store;
}

void report_small_buffer(Node& node, const ReceiveBuffer& buffer) {
  if (buffer.granted_bytes >= buffer.wanted_bytes) return;
  node.report(wire::Reason::kReceiveBufferSmall, std::to_string(buffer.granted_bytes) + " of " +
                                                     std::to_string(buffer.wanted_bytes) +
                                                     " bytes granted: raise net.core.rmem_max");
}

int serve(const Service& service, const Options& options) {
  // A wrong configuration ends the process before anything is opened.
  const std::string toml = options.config.empty() ? "" : read_config_file(options.config);
  std::string printed;
  const RuntimeParameters runtime = check_config(service, toml, options.config, &printed);
  if (options.prints_config) {
    std::cout << "# " << service.name << ": " << service.channels.summary() << "\n" << printed;
    return kDone;
  }

  // The bus, the service on it, and its state.
  StopSignal stop;
  const Clock clock = system_clock();
  const std::string url = options.lcm_url.empty() ? runtime.lcm_url : options.lcm_url;
  if (!options.is_open_bus) require_closed_bus(url);
  const std::unique_ptr<Bus> bus = make_live_bus(url);
  auto hosted = make_hosted(service, *bus, clock, toml, options);
  const auto store = recover_state(hosted, service, *bus, clock, toml, options);
  report_small_buffer(hosted->node(), bus->receive_buffer());

  // Start: messages arrive from here on.
  if (auto* const device = dynamic_cast<Device*>(&hosted->adapter())) {
    if (!options.state_dir.empty()) device->set_state_directory(options.state_dir);
    device->open();
  }
  hosted->node().connect();
  hosted->node().publish_config(hosted->table().to_toml());
  run_until_stopped(*hosted, *bus, stop, clock);
  return kDone;
}

std::string parameters_help(const Service& service) {
  RuntimeParameters runtime;
  ParameterTable table;
  const std::unique_ptr<Adapter> adapter = service.make();
  describe(runtime, table);
  adapter->describe(table);
  return "Parameters of the configuration file:\n" + table.help();
}

}  // namespace

int run_service(const Service& service, int argc, char** argv) {
  keep_freed_memory();
  // The name by which it was called, so that the usage line can be typed.
  CLI::App app(service.name + ": " + service.channels.summary(),
               std::filesystem::path(argv[0]).filename().string());
  Options options;
  app.add_option("--config", options.config, "Configuration file (TOML)");
  app.add_option("--lcm-url", options.lcm_url, "Bus; default LCM_DEFAULT_URL or LCM's own");
  app.add_option("--state-dir", options.state_dir, "Keep the state here, to go on after a restart");
  app.add_option("--channel-suffix", options.channel_suffix, "Appended to every output channel");

  app.add_flag("--open-bus", options.is_open_bus,
               "Allow a TTL above 0: other computers hear the bus and can send to it")
      ->envname("UNDERSTORY_OPEN_BUS");
  app.add_flag("--print-config", options.prints_config, "Print the configuration file in force");
  app.set_version_flag("--version", model::program_version());
  try {
    app.footer(service.channels.help() + "\n" + parameters_help(service));
    app.parse(argc, argv);
    return serve(service, options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  } catch (const ConfigurationError& error) {
    std::cerr << error.what() << '\n';
    return kWrongUsage;
  } catch (const std::exception& error) {
    std::cerr << service.name << ": " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace understory::bus
