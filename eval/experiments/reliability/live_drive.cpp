#include "eval/experiments/reliability/live_drive.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <optional>
#include <stdexcept>
#include <thread>

#include "common/bus/launch_config.hpp"
#include "common/bus/live_bus.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/slam_output.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/wire/convert.hpp"
#include "eval/experiments/reliability/processes.hpp"

namespace understory::eval::experiments::reliability {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// How long the processes may take to come up, and to answer what was sent last [s].
constexpr double kComesUp_s = 30.0;
constexpr double kAnswers_s = 3.0;

/// A group that no other drive of this computer uses.
std::string own_url() {
  static std::atomic<int> calls = 0;
  const int port = 20'000 + (::getpid() * 7 + 1000 * calls++) % 30'000;
  return fmt::format("udpm://239.255.76.67:{}?ttl=0", port);
}

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = std::filesystem::temp_directory_path() / "understory-reliability-XXXXXX";
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error(pattern + ": not made");
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::filesystem::path beside_this_program(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

void start_stack(Processes& processes, const LiveOptions& options, const std::string& url,
                 const std::filesystem::path& state) {
  if (options.supervised) {
    processes.start({beside_this_program("understory"),
                     {"launch", "--config", options.config_dir, "--state-dir", state, "--lcm-url",
                      url, "--quiet"},
                     {}});
    return;
  }
  for (const bus::ProcessEntry& entry : bus::read_launch_config(options.config_dir).processes) {
    const auto beside = beside_this_program(entry.executable);
    launch::Command command{std::filesystem::exists(beside) ? beside.string() : entry.executable,
                            {"--lcm-url", url},
                            {}};
    const auto add = [&](const std::string& option, const std::string& value) {
      command.arguments.insert(command.arguments.end(), {option, value});
    };
    if (!entry.config.empty()) add("--config", entry.config);
    if (entry.keeps_state) add("--state-dir", state / entry.name);
    processes.start(command);
  }
}

/// The tape, with what the faults hold back, and their signals, at their times.
class Player {
 public:
  Player(const SensorTape& tape, std::span<const Fault> faults, const std::string& url)
      : tape_(tape), faults_(faults), bus_(bus::make_live_bus(url)) {}

  /// `pid_of` gives the number of a process. Until the end of the tape, or `stops`.
  template <class WaitUntil, class PidOf>
  void play(const WaitUntil& wait_until, const PidOf& pid_of) {
    for (const SensorTape::Entry& entry : tape_.entries) {
      while (next_edge_s() <= entry.at_s) {
        if (!wait_until(next_edge_s())) return;
        pass_edge(pid_of);
      }
      if (!wait_until(entry.at_s)) return;
      if (is_held(entry.message.channel)) {
        held_.push_back(&entry.message);
      } else {
        send(entry.message);
      }
    }
  }

 private:
  double next_edge_s() const {
    if (now_ >= faults_.size()) return 1e18;
    return is_on_ ? faults_[now_].to_s : faults_[now_].from_s;
  }
  template <class PidOf>
  void pass_edge(const PidOf& pid_of) {
    for (const std::string& process : faults_[now_].stopped_processes) {
      const auto pid = static_cast<pid_t>(pid_of(process));
      if (pid > 0) ::kill(pid, is_on_ ? SIGCONT : SIGSTOP);
    }
    if (is_on_) {
      for (const harness::RawMessage* message : held_) send(*message);
      held_.clear();
      ++now_;
    }
    is_on_ = !is_on_;
  }
  bool is_held(const std::string& channel) const {
    return is_on_ && std::ranges::count(faults_[now_].held_channels, channel) > 0;
  }
  void send(const harness::RawMessage& message) {
    if (const auto refusal = bus_->publish(message.channel, message.bytes))
      throw std::runtime_error(message.channel + ": " + refusal->detail);
  }

  const SensorTape& tape_;
  std::span<const Fault> faults_;
  std::unique_ptr<bus::Bus> bus_;
  std::size_t now_ = 0;  ///< The fault that is on, or comes next.
  bool is_on_ = false;
  std::vector<const harness::RawMessage*> held_;
};

/// Everything that is heard of the stack.
class Listener {
 public:
  Listener(const std::string& url, std::span<const Fault> faults) : bus_(url), faults_(faults) {
    heard_.not_ok.resize(faults.size());
    bus_.subscribe("HEALTH", 0, [this](const bus::BusMessage& message) {
      const auto health = wire::decode_message<health_t>(message.bytes);
      if (!health) return;
      const std::lock_guard lock(mutex_);
      health_.add(*health);
      note_health();
    });
    bus_.subscribe("SLAM_POSE", 0, [this](const bus::BusMessage& message) {
      const auto pose = wire::decode_message<model::SlamPose>(message.bytes);
      if (!pose) return;
      if (const auto said = said_pose(*pose)) {
        heard_.slam.push_back(heard_now(*said));
        note_latency(pose->utime);
      }
    });
    bus_.subscribe("EKF_POSE", 0, [this](const bus::BusMessage& message) {
      const auto pose = wire::decode_message<model::EkfPose>(message.bytes);
      if (pose) heard_.filter.push_back(heard_now(said_pose(*pose)));
    });
  }

  void handle(int timeout_ms) { bus_.handle_one(timeout_ms); }
  /// From any thread.
  std::int64_t pid(const std::string& process) const {
    const std::lock_guard lock(mutex_);
    return health_.pid(process);
  }
  /// Time of the drive begins now.
  void begin() { start_ = SteadyClock::now(); }
  double now_s() const {
    if (!start_) return -1.0;
    return std::chrono::duration<double>(SteadyClock::now() - *start_).count();
  }
  LiveDrive take() {
    heard_.lost = health_.lost();
    return std::move(heard_);
  }

 private:
  SaidPose heard_now(SaidPose said) const {
    said.received_s = now_s();
    said.is_ok = health_.is_ok();
    return said;
  }
  void note_health() {
    const double at_s = now_s();
    for (std::size_t i = 0; i < faults_.size(); ++i) {
      const double end_s = i + 1 < faults_.size() ? faults_[i + 1].from_s : 1e18;
      if (at_s < faults_[i].from_s || at_s >= end_s || !heard_.not_ok[i].empty()) continue;
      heard_.not_ok[i] = health_.text();
    }
  }
  void note_latency(model::Utime utime) {
    const double at_s = now_s();
    const bool is_in_fault = std::ranges::any_of(faults_, [&](const Fault& fault) {
      return at_s >= fault.from_s && at_s < fault.to_s + kAnswers_s;
    });
    if (!is_in_fault) heard_.latency_ms.push_back(1e3 * (at_s - 1e-6 * static_cast<double>(utime)));
  }

  bus::LiveBus bus_;
  std::span<const Fault> faults_;
  mutable std::mutex mutex_;
  HealthState health_;
  LiveDrive heard_;
  std::optional<SteadyClock::time_point> start_;
};

void wait_for_processes(Listener& listener, const std::vector<std::string>& processes) {
  const auto end = SteadyClock::now() + std::chrono::duration<double>(kComesUp_s);
  for (const std::string& process : processes) {
    while (listener.pid(process) <= 0) {
      terminal::throw_if_interrupted();
      if (SteadyClock::now() > end) throw std::runtime_error(process + " does not come up");
      listener.handle(10);
    }
  }
}

}  // namespace

std::vector<std::string> processes_of(const std::filesystem::path& config_dir) {
  std::vector<std::string> names;
  for (const bus::ProcessEntry& entry : bus::read_launch_config(config_dir).processes)
    names.push_back(entry.name);
  return names;
}

LiveDrive play(const SensorTape& tape, std::span<const Fault> faults, const LiveOptions& options) {
  // Before the first process starts: an interrupt must leave none.
  const std::atomic<bool>& is_interrupted = terminal::catch_interrupts();
  const std::string url = own_url();
  const ScratchFolder folder;
  Listener listener(url, faults);
  Processes processes;
  start_stack(processes, options, url, folder.path());
  wait_for_processes(listener, processes_of(options.config_dir));

  // The tape in a thread of its own: what is heard must not keep it from its times.
  listener.begin();
  std::atomic<bool> stops = false;
  std::atomic<bool> is_over = false;
  std::exception_ptr failure;
  std::thread thread([&] {
    try {
      Player player(tape, faults, url);
      player.play(
          [&](double at_s) {
            const double wait_s = at_s - listener.now_s();
            if (wait_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
            return !stops;
          },
          [&](const std::string& process) { return listener.pid(process); });
    } catch (...) {
      failure = std::current_exception();
    }
    is_over = true;
  });

  while (!is_over && !is_interrupted) listener.handle(10);
  stops = true;
  thread.join();
  if (failure) std::rethrow_exception(failure);
  terminal::throw_if_interrupted();

  const double end_s = listener.now_s() + kAnswers_s;
  while (listener.now_s() < end_s) listener.handle(10);
  processes.ask_to_end();
  return listener.take();
}

}  // namespace understory::eval::experiments::reliability
