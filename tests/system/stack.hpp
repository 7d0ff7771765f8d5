// The whole stack as real processes on a multicast group of its own, and a simulated vehicle in it.
#pragma once

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <random>
#include <thread>
#include <vector>

#include "common/bus/live_bus.hpp"
#include "common/model/slam_output.hpp"
#include "common/wire/convert.hpp"
#include "deploy/launch/child_process.hpp"
#include "sim/drive.hpp"
#include "tests/io/log_fixture.hpp"
#include "understory/health_t.hpp"

namespace understory::test {

using Seconds = std::chrono::duration<double>;
using SteadyClock = std::chrono::steady_clock;

/// A configuration directory with four processes, each with the given parameters.
inline void write_config(const TemporaryDirectory& directory, const std::string& keyframer_toml) {
  std::ofstream(directory / "keyframer.toml") << keyframer_toml;
  std::ofstream(directory / "geoslam_mapper.toml") << "";
  std::ofstream(directory / "loop_closer.toml") << "";
  std::ofstream(directory / "existence_tracker.toml") << "";
  std::ofstream(directory / "launch.toml")
      << "[[process]]\nname = \"keyframer\"\nexecutable = \"understory-keyframer\"\n"
         "config = \"keyframer.toml\"\n"
         "[[process]]\nname = \"geoslam_mapper\"\nexecutable = \"understory-geoslam-mapper\"\n"
         "config = \"geoslam_mapper.toml\"\n"
         "[[process]]\nname = \"loop_closer\"\nexecutable = \"understory-loop-closer\"\n"
         "config = \"loop_closer.toml\"\n"
         "[[process]]\nname = \"existence_tracker\"\n"
         "executable = \"understory-existence-tracker\"\nconfig = \"existence_tracker.toml\"\n";
}

/// Another port for every test that may run beside this one.
inline std::string private_url() {
  static int calls = 0;
  const int port = 30'000 + (::getpid() * 7 + 1000 * calls++) % 20'000;
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
}

class Stack {
 public:
  /// `options`: further ones of `understory launch`.
  explicit Stack(const std::vector<std::string>& options = {}) : bus_(url_) {
    write_config(directory_, "");
    listen();
    launch::Command command{
        UNDERSTORY_COMMAND,
        {"launch", "--config", directory_.path(), "--state-dir", directory_ / "state", "--lcm-url",
         url_, "--report", report(), "--quiet"},
        {}};
    command.arguments.insert(command.arguments.end(), options.begin(), options.end());
    launch_ = launch::ChildProcess::start(command);
  }
  ~Stack() { stop(); }

  /// Handles messages until the condition holds; false after half a minute, since the processors
  /// may be busy with other tests.
  template <class Condition>
  bool wait_until(Condition condition) {
    const auto end = SteadyClock::now() + std::chrono::seconds(30);
    while (!condition()) {
      if (SteadyClock::now() > end) return false;
      bus_.handle_one(10);
    }
    return true;
  }
  bool wait_for_processes() {
    return wait_until([&] {
      return pid("keyframer") > 0 && pid("geoslam_mapper") > 0 && pid("loop_closer") > 0 &&
             pid("existence_tracker") > 0;
    });
  }
  /// Sends scans first..last-1 with pauses that let everybody keep up, and listens meanwhile.
  void drive(const sim::Drive& drive, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      publish("LANDMARKS", wire::encode_message(drive.scan(k).scan));
      const auto next = SteadyClock::now() + std::chrono::milliseconds(10);
      while (SteadyClock::now() < next) bus_.handle_one(2);
    }
  }
  void publish(const std::string& channel, std::span<const std::uint8_t> bytes) {
    if (bus_.publish(channel, bytes)) throw std::runtime_error(channel + ": not sent");
  }

  pid_t pid(const std::string& process) const {
    const auto found = health.find(process);
    return found == health.end() ? -1 : static_cast<pid_t>(found->second.pid);
  }
  std::int64_t malformed(const std::string& process, const std::string& channel) const {
    const auto found = health.find(process);
    if (found == health.end()) return -1;
    for (const auto& one : found->second.channels) {
      if (one.channel == channel) return one.malformed;
    }
    return -1;
  }
  model::Utime newest_pose() const { return poses.empty() ? -1 : poses.back().utime; }
  std::size_t updates(model::MapUpdateStatus status) const {
    return static_cast<std::size_t>(std::count_if(
        all_updates.begin(), all_updates.end(), [&](const auto& u) { return u.status == status; }));
  }

  /// SIGTERM; gives how launch ended.
  launch::Ending stop() {
    if (!launch_) return ending_;
    launch_->signal(SIGTERM);
    wait_until([&] {
      const auto ended = launch_->ended();
      if (ended) ending_ = *ended;
      return ended.has_value();
    });
    launch_.reset();
    return ending_;
  }
  std::string report() const { return directory_ / "report.json"; }
  const std::string& url() const { return url_; }

  std::map<std::string, health_t> health;  ///< Latest of each process.
  std::vector<model::SlamPose> poses;      ///< Localised ones.
  std::vector<model::MapUpdate> all_updates;
  std::size_t refused = 0;  ///< Messages of the processes that are not as they must be.

 private:
  template <class T, class Take>
  void subscribe(const std::string& channel, Take take) {
    bus_.subscribe(channel, 0, [this, take](const bus::BusMessage& message) {
      const auto value = wire::decode_message<T>(message.bytes);
      if (value) {
        take(*value);
      } else {
        ++refused;
      }
    });
  }
  void listen() {
    subscribe<health_t>("HEALTH", [this](const auto& one) { health[one.process] = one; });
    subscribe<model::SlamPose>("SLAM_POSE", [this](const model::SlamPose& pose) {
      if (pose.is_localised()) poses.push_back(pose);
    });
    subscribe<model::MapUpdate>("SLAM_UPDATE",
                                [this](const auto& one) { all_updates.push_back(one); });
  }

  TemporaryDirectory directory_;
  std::string url_ = private_url();
  bus::LiveBus bus_;
  std::optional<launch::ChildProcess> launch_;
  launch::Ending ending_;
};

/// 200 scans on a circle.
inline sim::Drive short_drive(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 40.0;
  return {parameters, seed};
}

/// The largest position error [m] of localised poses from `first` on, the map tied to the world at
/// the first update; -1 where there is nothing to compare.
inline double largest_error_m(const Stack& stack, const sim::Drive& drive, std::size_t first = 0) {
  std::map<model::Utime, geometry::SE2> truth;
  for (std::size_t k = 0; k < drive.size(); ++k) truth[drive.utime(k)] = drive.world_T_vehicle()[k];
  if (stack.all_updates.empty() || !truth.contains(stack.all_updates.front().utime)) return -1.0;

  const auto& base = stack.all_updates.front();
  const geometry::SE2 world_T_map = truth.at(base.utime) * base.map_T_vehicle.inverse();
  double largest = -1.0;

  for (std::size_t i = first; i < stack.poses.size(); ++i) {
    const auto& pose = stack.poses[i];
    const geometry::SE2 estimate = world_T_map * pose.map_T_vehicle();
    largest =
        std::max(largest, (estimate.translation() - truth.at(pose.utime).translation()).norm());
  }

  return largest;
}

}  // namespace understory::test
