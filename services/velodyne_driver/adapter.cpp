#include "services/velodyne_driver/adapter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/bus/device.hpp"
#include "common/io/data_error.hpp"
#include "common/io/recording_folder.hpp"
#include "services/velodyne_driver/adapter_parameters.hpp"
#include "services/velodyne_driver/packet_sockets.hpp"
#include "services/velodyne_driver/sensor_watch.hpp"
#include "services/velodyne_driver/velodyne_driver.hpp"

namespace understory::velodyne_driver {
namespace {

constexpr int kPacketsAtOnce = 64;
constexpr std::int64_t kSummaryPeriod_us = 10'000'000;
constexpr int kWait_ms = 100;

io::VelodyneCalibration load_calibration(const VelodyneSensorParameters& sensor) {
  const io::VelodyneModel model = io::velodyne_model(sensor.model).value();
  const bool has_file = !sensor.calibration_file.empty();
  if (model == io::VelodyneModel::kHdl64e && !has_file)
    throw bus::ConfigurationError(
        {"sensor.calibration_file: an hdl64e needs its own XML or YAML file"});
  if (model != io::VelodyneModel::kHdl64e && has_file)
    throw bus::ConfigurationError(
        {"sensor.calibration_file: only an hdl64e has one, not a " + sensor.model});
  if (!has_file) return velodyne_calibration(model);
  try {
    const std::filesystem::path file(sensor.calibration_file);
    const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    return io::parse_hdl64_calibration(io::RecordingFolder(folder).read(file.filename().string()),
                                       sensor.calibration_file);
  } catch (const io::DataError& error) {
    throw bus::ConfigurationError({std::string("sensor.calibration_file: ") + error.what()});
  }
}

void check_addresses(const VelodyneNetworkParameters& network) {
  if (!parse_ipv4(network.bind_address))
    throw bus::ConfigurationError(
        {"network.bind_address: \"" + network.bind_address + "\" is not an IPv4 address"});
  if (!network.sensor_address.empty() && !parse_ipv4(network.sensor_address))
    throw bus::ConfigurationError(
        {"network.sensor_address: \"" + network.sensor_address + "\" is not an IPv4 address"});
}

std::string summary(const VelodyneDriverCounts& c, std::uint64_t overruns,
                    std::uint64_t other_senders) {
  return fmt::format(
      "data packets {} (refused: size {}, model {}, damaged {}, late {}; other senders {}; thrown "
      "away by the kernel {}), sweeps {} (with holes {}), gaps {}, clock jumps {}, position "
      "packets "
      "{} (bad {}), fixes {}",
      c.data_packets, c.wrong_size, c.wrong_model, c.damaged, c.late, other_senders, overruns,
      c.sweeps, c.holes, c.gaps, c.jumps, c.position_packets, c.bad_positions, c.fixes);
}

class VelodyneDriverAdapter : public bus::Adapter, public bus::Device {
 public:
  explicit VelodyneDriverAdapter(VelodyneDriverChannels channels)
      : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    velodyne_driver::describe(parameters_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    check_addresses(parameters_.network);
    stage_.emplace(parameters_, load_calibration(parameters_.sensor));
    sender_.fix(parameters_.network.sensor_address);
    silence_.set_silence_s(parameters_.sensor.silence_s);
    outbox_ = SweepOutbox(node.advertise<model::PointSweep>(channels_.raw_sweep));
    fixes_ = node.advertise<model::GnssFix>(channels_.raw_gnss);
  }

  void open() override {
    sockets_.emplace(parameters_.network);
    const UdpSocket& data = sockets_->data();
    node_->log(bus::Node::Level::kInfo, "listens",
               fmt::format("{}: data port {}, position port {}, receive buffer {} bytes{}",
                           parameters_.network.bind_address, data.port(),
                           sockets_->positions().port(), data.receive_buffer_bytes(),
                           data.reports_overruns() ? "" : "; the kernel does not count overruns"));
  }

  std::vector<int> file_descriptors() const override { return sockets_->file_descriptors(); }

  void attend(std::int64_t now_us) override {
    silence_.start(now_us);
    if (summed_us_ < 0) summed_us_ = now_us;

    // What has come.
    for (int i = 0; i < kPacketsAtOnce; ++i) {
      const auto datagram = sockets_->data().receive();
      if (!datagram) break;
      take_data(*datagram, now_us);
    }
    for (int i = 0; i < kPacketsAtOnce; ++i) {
      const auto datagram = sockets_->positions().receive();
      if (!datagram) break;
      take_position(*datagram);
    }
    outbox_.send_part();

    // What is wrong.
    report(sockets_->new_faults(), channels_.raw_sweep);
    watch(now_us);
    if (now_us - summed_us_ >= kSummaryPeriod_us) sum_up(now_us);
  }

  int wait_ms() const override {
    if (!outbox_.empty()) return 0;
    return std::min(kWait_ms, static_cast<int>(500.0 * parameters_.sensor.silence_s) + 1);
  }

  void finish() override {
    if (!sockets_) return;
    if (const auto sweep = stage_->finish()) post(*sweep);
    while (!outbox_.empty()) outbox_.send_part();
    node_->log(bus::Node::Level::kInfo, "packets",
               summary(stage_->counts(), sockets_->overruns(), sender_.refused()),
               channels_.raw_sweep);
  }

 private:
  bool is_from_sensor(const Datagram& datagram, const std::string& channel) {
    if (sender_.admits(datagram.sender)) return true;
    node_->report(wire::Reason::kInconsistent,
                  fmt::format("a packet of {} beside those of {}: set network.sensor_address",
                              ipv4_text(datagram.sender), ipv4_text(*sender_.sensor())),
                  channel);
    return false;
  }

  void take_data(const Datagram& datagram, std::int64_t now_us) {
    if (silence_.is_overdue(now_us)) sender_.forget();
    if (!is_from_sensor(datagram, channels_.raw_sweep)) return;

    const std::uint64_t refused = stage_->counts().refused();
    const VelodyneDriverOutput output =
        stage_->add_data(datagram.bytes, datagram.size, datagram.received);
    report(output.faults, channels_.raw_sweep);
    if (stage_->counts().refused() == refused) {
      sender_.set_sensor(datagram.sender);
      if (silence_.hear(now_us))
        node_->log(bus::Node::Level::kInfo, "sensor_speaks", "packets come again");
    }

    if (output.sweep) post(*output.sweep);
  }

  void take_position(const Datagram& datagram) {
    if (!is_from_sensor(datagram, channels_.raw_gnss)) return;
    const VelodyneDriverOutput output =
        stage_->add_position(datagram.bytes, datagram.size, datagram.received);
    report(output.faults, channels_.raw_gnss);
    if (output.fix && parameters_.gnss.is_published) fixes_.publish(*output.fix);
  }

  void report(const std::vector<wire::Refusal>& faults, const std::string& channel) {
    for (const wire::Refusal& fault : faults) node_->report(fault.reason, fault.detail, channel);
  }

  void post(const model::PointSweep& sweep) {
    if (!outbox_.post(sweep))
      node_->report(wire::Reason::kQueueFull, "the bus is too slow: a sweep is left out",
                    channels_.raw_sweep);
  }

  /// Once a second, so that HEALTH keeps the state for as long as it lasts.
  void watch(std::int64_t now_us) {
    const SilenceWatch::Due due = silence_.look(now_us);
    if (due == SilenceWatch::Due::kReportSilence) {
      node_->report(wire::Reason::kSensorSilent,
                    fmt::format("no good packet on UDP port {} for {:.1f} s",
                                sockets_->data().port(), silence_.silent_s(now_us)),
                    channels_.raw_sweep);
    } else if (due == SilenceWatch::Due::kCheckClock) {
      if (const auto fault = stage_->clock_fault())
        node_->report(fault->reason, fault->detail, channels_.raw_sweep);
    }
  }

  void sum_up(std::int64_t now_us) {
    summed_us_ = now_us;
    std::string text = summary(stage_->counts(), sockets_->overruns(), sender_.refused());
    if (text == summary_) return;
    summary_ = std::move(text);
    node_->log(bus::Node::Level::kInfo, "packets", summary_, channels_.raw_sweep);
  }

  VelodyneDriverChannels channels_;
  VelodyneDriverParameters parameters_;
  bus::Node* node_ = nullptr;
  std::optional<VelodyneDriver> stage_;
  std::optional<PacketSockets> sockets_;
  SenderFilter sender_;
  SilenceWatch silence_;
  SweepOutbox outbox_;
  bus::Publisher<model::GnssFix> fixes_;
  std::int64_t summed_us_ = -1;  ///< When the counts were last logged, monotonic.
  std::string summary_;          ///< As last logged.
};

}  // namespace

bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels) {
  return {"velodyne_driver",
          "a Velodyne laser's UDP packets -> " + channels.raw_sweep + ", " + channels.raw_gnss,
          [channels] { return std::make_unique<VelodyneDriverAdapter>(channels); }};
}

}  // namespace understory::velodyne_driver
