#include "eval/harness/sensor_chain.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/bus/config_file.hpp"
#include "common/bus/launch_config.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::harness {

/// The shared bus, with a stopwatch around one service's handlers.
class SensorChain::TimedBus : public bus::Bus {
 public:
  explicit TimedBus(bus::Bus& bus) : bus_(bus) {}

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override {
    return bus_.publish(channel, bytes);
  }
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override {
    bus_.subscribe(channel, queue_size,
                   [this, handler = std::move(handler)](const bus::BusMessage& message) {
                     if (is_paused) return;
                     const double start_s = tools::thread_time_s();
                     handler(message);
                     const double took_s = tools::thread_time_s() - start_s;
                     time.total_s += took_s;
                     time.calls_ms.push_back(static_cast<float>(took_s * 1e3));
                   });
  }
  bool handle_one(int timeout_ms) override { return bus_.handle_one(timeout_ms); }
  std::uint64_t dropped(std::string_view channel) const override { return bus_.dropped(channel); }

  ServiceTime time;
  bool is_paused = false;  ///< The service hears nothing.

 private:
  bus::Bus& bus_;
};

SensorChain::SensorChain(const std::vector<bus::Service>& services,
                         const std::filesystem::path& config_dir,
                         const std::map<std::string, std::string>& toml_instead)
    : bus_(bus::MemoryBus::Queues::kUnlimited) {
  // Defaults instead of a configuration that is not found would be wrong in silence.
  if (!config_dir.empty() && !std::filesystem::is_directory(config_dir))
    throw bus::ConfigurationError({"no such configuration folder: " + config_dir.string()});
  for (const bus::Service& service : services) {
    const std::filesystem::path file = bus::config_file_in(config_dir, service.name);
    const auto instead = toml_instead.find(service.name);
    const std::string toml = instead != toml_instead.end() ? instead->second
                             : file.empty()                ? ""
                                                           : bus::read_config_file(file);
    // A text in place of a file may build on that file; what is relative in it stays so.
    const std::filesystem::path name =
        instead == toml_instead.end() ? file : file.parent_path() / (service.name + " (instead)");
    auto bus = std::make_unique<TimedBus>(bus_);
    auto hosted =
        std::make_unique<bus::HostedService>(service, *bus, bus::no_clock(), toml, name.string());
    hosted_.push_back({service.name, std::move(bus), std::move(hosted)});
  }
}

SensorChain::~SensorChain() = default;

void SensorChain::begin() {
  has_begun_ = true;
  for (const Hosted& hosted : hosted_) hosted.service->node().connect();
}

void SensorChain::feed(std::string_view channel, std::span<const std::uint8_t> bytes) {
  if (!has_begun_) begin();
  bus_.publish(channel, bytes);
  bus_.drain();
}

bool SensorChain::takes(std::string_view channel) const {
  const auto hears = [&](const Hosted& hosted) { return hosted.service->node().takes(channel); };
  const auto publishes = [&](const Hosted& hosted) {
    const std::vector<std::string> outputs = hosted.service->node().outputs();
    return std::ranges::find(outputs, channel) != outputs.end();
  };
  return std::ranges::any_of(hosted_, hears) && std::ranges::none_of(hosted_, publishes);
}

void SensorChain::pause(std::string_view service, bool is_paused) {
  for (const Hosted& hosted : hosted_) {
    if (hosted.name != service) continue;
    hosted.bus->is_paused = is_paused;
    return;
  }
  throw std::out_of_range("no service " + std::string(service) + " in the chain");
}

void SensorChain::finish() {
  for (const Hosted& hosted : hosted_) {
    hosted.service->adapter().finish();
    bus_.drain();
  }
}

const ServiceTime& SensorChain::time_of(std::string_view service) const {
  for (const Hosted& hosted : hosted_) {
    if (hosted.name == service) return hosted.bus->time;
  }
  throw std::out_of_range("no service " + std::string(service) + " in the chain");
}

std::string SensorChain::state_of(std::string_view service) const {
  for (const Hosted& hosted : hosted_) {
    if (hosted.name == service) return hosted.service->adapter().save();
  }
  throw std::out_of_range("no service " + std::string(service) + " in the chain");
}

std::vector<float> SensorChain::take_calls_ms(std::string_view service) {
  for (const Hosted& hosted : hosted_) {
    if (hosted.name == service) return std::exchange(hosted.bus->time.calls_ms, {});
  }
  throw std::out_of_range("no service " + std::string(service) + " in the chain");
}

std::vector<std::string> SensorChain::services() const {
  std::vector<std::string> names;
  for (const Hosted& hosted : hosted_) names.push_back(hosted.name);
  return names;
}

health_t SensorChain::health_of(std::string_view service) {
  for (const Hosted& hosted : hosted_) {
    if (hosted.name == service) return hosted.service->node().health();
  }
  throw std::out_of_range("no service " + std::string(service) + " in the chain");
}

}  // namespace understory::eval::harness
