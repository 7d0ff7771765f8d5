#include "services/velodyne_driver/adapter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/bus/device.hpp"
#include "common/io/data_error.hpp"
#include "common/io/recording_folder.hpp"
#include "services/velodyne_driver/adapter_parameters.hpp"
#include "services/velodyne_driver/udp_socket.hpp"
#include "services/velodyne_driver/velodyne_driver.hpp"

namespace understory::velodyne_driver {
namespace {

constexpr std::size_t kPointsPerPart = 4000;  // 10 bytes each: one message is well below 60 kB
constexpr std::size_t kMostPartsWaiting = 250;
constexpr int kPacketsAtOnce = 64;
constexpr std::int64_t kSecond_us = 1'000'000;
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
      "away by the kernel {}), turns {} (with holes {}), gaps {}, clock jumps {}, position packets "
      "{} (bad {}), fixes {}",
      c.data_packets, c.wrong_size, c.wrong_model, c.damaged, c.late, other_senders, overruns,
      c.turns, c.holes, c.gaps, c.jumps, c.position_packets, c.bad_positions, c.fixes);
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
    sensor_ = parse_ipv4(parameters_.network.sensor_address);
    sweeps_ = node.advertise<model::PointSweep>(channels_.raw_sweep);
    fixes_ = node.advertise<model::GnssFix>(channels_.raw_gnss);
  }

  void open() override {
    const VelodyneNetworkParameters& n = parameters_.network;
    data_.emplace(n.bind_address, n.data_port, n.receive_buffer_bytes);
    positions_.emplace(n.bind_address, n.position_port, n.receive_buffer_bytes);
    node_->log(
        bus::Node::Level::kInfo, "listens",
        fmt::format("{}: data port {}, position port {}, receive buffer {} bytes{}", n.bind_address,
                    data_->port(), positions_->port(), data_->receive_buffer_bytes(),
                    data_->reports_overruns() ? "" : "; the kernel does not tell overruns"));
  }

  std::vector<int> file_descriptors() const override {
    return {data_->file_descriptor(), positions_->file_descriptor()};
  }

  void attend(std::int64_t now_us) override {
    if (good_us_ < 0) good_us_ = reported_us_ = summed_us_ = now_us;
    for (int i = 0; i < kPacketsAtOnce; ++i) {
      const auto datagram = data_->receive();
      if (!datagram) break;
      take_data(*datagram, now_us);
    }
    for (int i = 0; i < kPacketsAtOnce; ++i) {
      const auto datagram = positions_->receive();
      if (!datagram) break;
      take_position(*datagram);
    }
    send_part();
    say_socket_faults();
    if (now_us - reported_us_ >= kSecond_us || now_us - good_us_ >= silence_us()) watch(now_us);
    if (now_us - summed_us_ >= kSummaryPeriod_us) sum_up(now_us);
  }

  int wait_ms() const override {
    if (!outbox_.empty()) return 0;
    return std::min(kWait_ms, static_cast<int>(500.0 * parameters_.sensor.silence_s) + 1);
  }

  void finish() override {
    if (!data_) return;
    if (auto turn = stage_->finish()) post(*turn);
    while (!outbox_.empty()) send_part();
    node_->log(bus::Node::Level::kInfo, "packets",
               summary(stage_->counts(), overruns(), other_senders_), channels_.raw_sweep);
  }

 private:
  std::int64_t silence_us() const {
    return static_cast<std::int64_t>(1e6 * parameters_.sensor.silence_s);
  }
  std::uint64_t overruns() const { return data_->overruns() + positions_->overruns(); }

  /// Packets of two sensors on one port would be mixed into one turn.
  bool is_from_sensor(const Datagram& datagram, std::string_view channel) {
    if (!sensor_ || *sensor_ == datagram.sender) return true;
    ++other_senders_;
    node_->report(wire::Reason::kInconsistent,
                  fmt::format("a packet of {} beside those of {}: set network.sensor_address",
                              ipv4_text(datagram.sender), ipv4_text(*sensor_)),
                  channel);
    return false;
  }

  void take_data(const Datagram& datagram, std::int64_t now_us) {
    // Whoever spoke first may have been replaced.
    const bool is_fixed = !parameters_.network.sensor_address.empty();
    if (!is_fixed && now_us - good_us_ >= silence_us()) sensor_.reset();
    if (!is_from_sensor(datagram, channels_.raw_sweep)) return;
    const std::uint64_t refused = stage_->counts().refused();
    VelodyneDriverOutput output =
        stage_->add_data(datagram.bytes, datagram.size, datagram.received);
    report(output.faults, channels_.raw_sweep);
    if (stage_->counts().refused() == refused) {
      sensor_ = datagram.sender;
      good_us_ = now_us;
      if (is_silent_) node_->log(bus::Node::Level::kInfo, "sensor_speaks", "packets come again");
      is_silent_ = false;
    }
    if (output.turn) post(*output.turn);
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

  void post(const model::PointSweep& turn) {
    if (outbox_.size() >= kMostPartsWaiting)
      return node_->report(wire::Reason::kQueueFull, "the bus is too slow: a turn is left out",
                           channels_.raw_sweep);
    for (model::PointSweep& part : split_sweep(turn, kPointsPerPart))
      outbox_.push_back(std::move(part));
  }

  /// One at a time, since publishing is paced: in between the socket is emptied.
  void send_part() {
    if (outbox_.empty()) return;
    sweeps_.publish(outbox_.front());
    outbox_.pop_front();
  }

  void say_socket_faults() {
    if (overruns() > overruns_) {
      overruns_ = overruns();
      node_->report(wire::Reason::kQueueFull,
                    fmt::format("the kernel threw away {} packets so far: raise net.core.rmem_max",
                                overruns_),
                    channels_.raw_sweep);
    }
    const std::uint64_t errors = data_->errors() + positions_->errors();
    if (errors > errors_) {
      const bool of_data = !data_->last_error().empty();
      node_->report(wire::Reason::kStageFailed,
                    of_data ? data_->last_error() : positions_->last_error(), channels_.raw_sweep);
    }
    errors_ = errors;
  }

  /// Once a second, so that HEALTH stays what it is for as long as it lasts.
  void watch(std::int64_t now_us) {
    const bool was_silent = std::exchange(is_silent_, now_us - good_us_ >= silence_us());
    if (is_silent_ && was_silent && now_us - reported_us_ < kSecond_us) return;
    reported_us_ = now_us;
    if (is_silent_) {
      node_->report(wire::Reason::kSensorSilent,
                    fmt::format("no good packet on UDP port {} for {:.1f} s", data_->port(),
                                1e-6 * static_cast<double>(now_us - good_us_)),
                    channels_.raw_sweep);
    } else if (const auto fault = stage_->clock_fault()) {
      node_->report(fault->reason, fault->detail, channels_.raw_sweep);
    }
  }

  void sum_up(std::int64_t now_us) {
    summed_us_ = now_us;
    std::string text = summary(stage_->counts(), overruns(), other_senders_);
    if (text == summary_) return;
    summary_ = std::move(text);
    node_->log(bus::Node::Level::kInfo, "packets", summary_, channels_.raw_sweep);
  }

  VelodyneDriverChannels channels_;
  VelodyneDriverParameters parameters_;
  bus::Node* node_ = nullptr;
  std::optional<VelodyneDriver> stage_;
  std::optional<UdpSocket> data_;
  std::optional<UdpSocket> positions_;
  std::optional<std::uint32_t> sensor_;  ///< Whose packets are taken.
  std::deque<model::PointSweep> outbox_;
  bus::Publisher<model::PointSweep> sweeps_;
  bus::Publisher<model::GnssFix> fixes_;
  std::uint64_t other_senders_ = 0;
  std::uint64_t overruns_ = 0;
  std::uint64_t errors_ = 0;
  bool is_silent_ = false;
  std::int64_t good_us_ = -1;  ///< When the last good data packet came, monotonic.
  std::int64_t reported_us_ = -1;
  std::int64_t summed_us_ = -1;
  std::string summary_;
};

}  // namespace

bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels) {
  return {"velodyne_driver",
          "a Velodyne laser's UDP packets -> " + channels.raw_sweep + ", " + channels.raw_gnss,
          [channels] { return std::make_unique<VelodyneDriverAdapter>(channels); }};
}

}  // namespace understory::velodyne_driver
