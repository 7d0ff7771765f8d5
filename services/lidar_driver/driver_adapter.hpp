// Connects a laser's driver of any maker to the network and the bus.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/device.hpp"
#include "common/bus/node.hpp"
#include "common/bus/service.hpp"
#include "common/packets/survey.hpp"
#include "services/lidar_driver/packet_sockets.hpp"
#include "services/lidar_driver/sensor_watch.hpp"

namespace understory::lidar_driver {

/// Names of the channels that a driver publishes on; empty = not published.
struct DriverChannels {
  std::string sweep;
  std::string imu;
  std::string gnss;
};

/// Settings of the adapter, from a family's parameters.
struct DriverSettings {
  NetworkParameters network;
  std::vector<PortSettings> ports;  ///< The first is the port of point packets.
  double silence_s = 1.0;
  bool publishes_imu = false;
  bool publishes_gnss = false;
};

/// Passes packets to a family's stage and publishes the results. `Family` has `Parameters`, `Stage`
/// (add, finish, clock_fault and summary as PacketStage), `describe(Parameters&, table)`,
/// `settings(const Parameters&, channels)` and `make_stage(const Parameters&)`; the last two throw
/// ConfigurationError.
template <class Family>
class DriverAdapter : public bus::Adapter, public bus::Device {
 public:
  explicit DriverAdapter(DriverChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override { Family::describe(parameters_, table); }

  void bind(bus::Node& node) override {
    node_ = &node;
    settings_ = Family::settings(parameters_, channels_);
    check_addresses(settings_.network);
    stage_.emplace(Family::make_stage(parameters_));
    sender_.fix(settings_.network.sensor_address);
    silence_.set_silence_s(settings_.silence_s);
    outputs_.sweeps = SweepOutbox(node.advertise<model::PointSweep>(channels_.sweep));
    if (!channels_.imu.empty()) outputs_.imu = node.advertise<model::ImuSample>(channels_.imu);
    if (!channels_.gnss.empty()) outputs_.fixes = node.advertise<model::GnssFix>(channels_.gnss);
  }

  void open() override {
    sockets_.emplace(settings_.network, settings_.ports);
    std::string ports;
    for (std::size_t i = 0; i < settings_.ports.size(); ++i)
      ports += fmt::format("{} port {}, ", settings_.ports[i].name, (*sockets_)[i].port());
    const UdpSocket& points = (*sockets_)[0];
    node_->log(
        bus::Node::Level::kInfo, "listens",
        fmt::format("{}: {}receive buffer {} bytes{}", settings_.network.bind_address, ports,
                    points.receive_buffer_bytes(),
                    points.reports_overruns() ? "" : "; the kernel does not count overruns"));
  }

  std::vector<int> file_descriptors() const override { return sockets_->file_descriptors(); }

  void attend(std::int64_t now_us) override {
    silence_.start(now_us);
    if (summed_us_ < 0) summed_us_ = now_us;

    // Processes the received packets.
    for (std::size_t port = 0; port < sockets_->size(); ++port) {
      for (int i = 0; i < kPacketsAtOnce; ++i) {
        const auto datagram = (*sockets_)[port].receive();
        if (!datagram) break;
        take(port, *datagram, now_us);
      }
    }
    outputs_.sweeps.send_part();

    // Reports faults.
    report(sockets_->new_faults(), channels_.sweep);
    watch(now_us);
    if (now_us - summed_us_ >= kSummaryPeriod_us) sum_up(now_us);
  }

  int wait_ms() const override {
    if (!outputs_.sweeps.empty()) return 0;
    return std::min(kWait_ms, static_cast<int>(500.0 * settings_.silence_s) + 1);
  }

  void finish() override {
    if (!sockets_) return;
    if (const auto sweep = stage_->finish()) post(*sweep);
    while (!outputs_.sweeps.empty()) outputs_.sweeps.send_part();
    node_->log(bus::Node::Level::kInfo, "packets", summary(), channels_.sweep);
  }

 private:
  struct Outputs {
    SweepOutbox sweeps;
    bus::Publisher<model::ImuSample> imu;
    bus::Publisher<model::GnssFix> fixes;
  };
  static constexpr int kPacketsAtOnce = 64;
  static constexpr std::int64_t kSummaryPeriod_us = 10'000'000;
  static constexpr int kWait_ms = 100;

  std::string summary() const { return stage_->summary({sockets_->overruns(), sender_.refused()}); }

  bool is_from_sensor(const Datagram& datagram, const std::string& channel) {
    if (sender_.admits(datagram.sender)) return true;
    node_->report(wire::Reason::kInconsistent,
                  fmt::format("a packet of {} beside those of {}: set network.sensor_address",
                              packets::address_text(datagram.sender),
                              packets::address_text(*sender_.sensor())),
                  channel);
    return false;
  }

  void take(std::size_t port, const Datagram& datagram, std::int64_t now_us) {
    const std::string& channel = settings_.ports[port].channel;
    const bool has_points = port == 0;
    if (has_points && silence_.is_overdue(now_us)) sender_.forget();
    if (!is_from_sensor(datagram, channel)) return;

    const DriverOutput output = stage_->add(port, datagram.bytes, datagram.size, datagram.received);
    report(output.faults, channel);
    if (has_points && !output.is_refused) {
      sender_.set_sensor(datagram.sender);
      if (silence_.hear(now_us))
        node_->log(bus::Node::Level::kInfo, "sensor_speaks", "packets come again");
    }
    publish(output);
  }

  void publish(const DriverOutput& output) {
    for (const model::PointSweep& sweep : output.sweeps) post(sweep);
    if (settings_.publishes_imu) {
      for (const model::ImuSample& sample : output.imu) outputs_.imu.publish(sample);
    }
    if (settings_.publishes_gnss) {
      for (const model::GnssFix& fix : output.fixes) outputs_.fixes.publish(fix);
    }
  }

  void report(const std::vector<wire::Refusal>& faults, const std::string& channel) {
    for (const wire::Refusal& fault : faults) node_->report(fault.reason, fault.detail, channel);
  }

  void post(const model::PointSweep& sweep) {
    if (!outputs_.sweeps.post(sweep))
      node_->report(wire::Reason::kQueueFull, "the bus is too slow: a sweep is left out",
                    channels_.sweep);
  }

  /// Reports once a second, so that HEALTH keeps the state as long as it lasts.
  void watch(std::int64_t now_us) {
    const SilenceWatch::Due due = silence_.look(now_us);
    if (due == SilenceWatch::Due::kReportSilence) {
      node_->report(wire::Reason::kSensorSilent,
                    fmt::format("no good packet on UDP port {} for {:.1f} s", (*sockets_)[0].port(),
                                silence_.silent_s(now_us)),
                    channels_.sweep);
    } else if (due == SilenceWatch::Due::kCheckClock) {
      if (const auto fault = stage_->clock_fault())
        node_->report(fault->reason, fault->detail, channels_.sweep);
    }
  }

  void sum_up(std::int64_t now_us) {
    summed_us_ = now_us;
    std::string text = summary();
    if (text == summary_) return;
    summary_ = std::move(text);
    node_->log(bus::Node::Level::kInfo, "packets", summary_, channels_.sweep);
  }

  DriverChannels channels_;
  typename Family::Parameters parameters_;
  DriverSettings settings_;
  bus::Node* node_ = nullptr;
  std::optional<typename Family::Stage> stage_;
  std::optional<PacketSockets> sockets_;
  SenderFilter sender_;
  SilenceWatch silence_;
  Outputs outputs_;
  std::int64_t summed_us_ = -1;  ///< Time of the last log of the counts, monotonic.
  std::string summary_;          ///< As last logged.
};

}  // namespace understory::lidar_driver
