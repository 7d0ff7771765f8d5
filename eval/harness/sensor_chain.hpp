// Services on one bus in one process, fed with raw readings and timed one by one.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "understory/health_t.hpp"

namespace understory::eval::harness {

/// A message before it is on a bus.
struct RawMessage {
  model::Utime utime = 0;
  std::string channel;
  wire::Bytes bytes;
};

/// Processor time of one service.
struct ServiceTime {
  double total_s = 0.0;
  std::vector<float> calls_ms;  ///< Of each message that it handled, in order.
};

/// As `understory replay` hosts them: what a message leads to is handed out before the next one.
class SensorChain {
 public:
  /// The parameters of each service are read from its file in `config_dir` (config_file_in), unless
  /// `toml_instead` has their text. Throws ConfigurationError, also where that folder is not there;
  /// an empty path means the defaults.
  SensorChain(const std::vector<bus::Service>& services, const std::filesystem::path& config_dir,
              const std::map<std::string, std::string>& toml_instead = {});
  ~SensorChain();

  /// Hands the message in, and out all that follows from it.
  void feed(std::string_view channel, std::span<const std::uint8_t> bytes);
  /// The same for a message in one value.
  void feed(const RawMessage& message) { feed(message.channel, message.bytes); }
  /// Whether a service hears this channel and none of them publishes it: what a recording is fed
  /// by.
  bool takes(std::string_view channel) const;
  /// The service hears nothing until this is called with false: it hangs, or is being started
  /// again from its state. Throws std::out_of_range for an unknown name.
  void pause(std::string_view service, bool is_paused);
  /// Ends the drive: the services may publish once more.
  void finish();

  /// `handler` takes a T (a value of common/model or a wire type); to be called before feed().
  template <class T, class F>
  void watch(const std::string& channel, F handler) {
    bus_.subscribe(channel, 0, [handler = std::move(handler)](const bus::BusMessage& message) {
      if (const auto value = wire::decode_message<T>(message.bytes)) handler(*value);
    });
  }

  /// State of a service as it saves itself. Throws std::out_of_range for an unknown name.
  std::string state_of(std::string_view service) const;

  /// Processor time of a service. Throws std::out_of_range for an unknown name.
  const ServiceTime& time_of(std::string_view service) const;
  /// The times of the calls since the last time that they were taken; a long drive's would grow.
  /// Throws std::out_of_range for an unknown name.
  std::vector<float> take_calls_ms(std::string_view service);
  /// Names of the services, in the order in which they were given.
  std::vector<std::string> services() const;
  /// The service's HEALTH as of now. Throws std::out_of_range for an unknown name.
  health_t health_of(std::string_view service);

 private:
  class TimedBus;
  struct Hosted {
    std::string name;
    std::unique_ptr<TimedBus> bus;
    std::unique_ptr<bus::HostedService> service;
  };
  void begin();

  bus::MemoryBus bus_;
  std::vector<Hosted> hosted_;
  bool has_begun_ = false;
};

}  // namespace understory::eval::harness
