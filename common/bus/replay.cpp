#include "common/bus/replay.hpp"

#include <optional>
#include <set>

#include "common/bus/config_file.hpp"
#include "common/bus/launch_config.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/io/lcm_log.hpp"
#include "understory/config_t.hpp"
#include "understory/log_t.hpp"

namespace understory::bus {
namespace {

class Replay {
 public:
  explicit Replay(const ReplayOptions& options)
      : options_(options),
        reader_(options.log),
        bus_(MemoryBus::Queues::kUnlimited,
             [this](const BusMessage& message) { record_derived(message); }) {
    if (!options.out.empty()) writer_.emplace(options.out);
    for (const Service& service : options.services) host(service);
  }

  ReplayReport run() {
    bool has_begun = false;
    while (auto event = reader_.next()) {
      ++report_.events;
      log_utime_ = event->utime;
      if (!has_begun) begin();
      has_begun = true;
      take(*event);
      if (options_.progress && report_.events % 256 == 0 && options_.progress(part_done())) {
        report_.was_stopped = true;
        return report_;
      }
    }

    reader_.refuse_other_files();
    if (report_.fed == 0 && report_.events > 0) refuse_unfed();
    finish();
    if (writer_) writer_->commit();
    report_.damaged_places = reader_.damage().places;
    report_.damaged_bytes = reader_.damage().bytes;
    for (const auto& hosted : hosted_) report_.health.push_back(hosted->node().health());
    if (options_.progress) options_.progress(1.0);

    return report_;
  }

 private:
  void host(const Service& service) {
    const std::filesystem::path file = config_file_in(options_.config_dir, service.name);
    std::string name = file.string();
    std::string toml = file.empty() ? "" : read_config_file(file);
    if (const auto layer = options_.layers.find(service.name); layer != options_.layers.end()) {
      name = layer->second.name;
      toml = layer_over(file, layer->second.table);
    }

    hosted_.push_back(std::make_unique<HostedService>(
        service, bus_, no_clock(), toml, name, [&](RuntimeParameters& runtime) {
          if (!options_.channel_suffix.empty()) runtime.channel_suffix = options_.channel_suffix;
        }));
    Node& node = hosted_.back()->node();
    names_.insert(node.options().process);
    for (const std::string& channel : node.outputs()) outputs_.insert(channel);
  }

  /// Publishes CONFIG first, with the log's first stamp.
  void begin() {
    for (const auto& hosted : hosted_) hosted->node().connect();
    for (const auto& hosted : hosted_) hosted->node().publish_config(hosted->table().to_toml());
    bus_.drain();
  }

  /// Lets services publish at the end, with the log's last stamp.
  void finish() {
    for (const auto& hosted : hosted_) {
      hosted->adapter().finish();
      bus_.drain();
    }
  }

  void take(const io::LogEvent& event) {
    if (report_.fed == 0) channels_.insert(event.channel);
    if (is_own_output(event)) {
      ++report_.left_out;
      return;
    }

    if (writer_ && options_.keeps_inputs) writer_->write(event.utime, event.channel, event.data);
    bool is_taken = false;
    for (const auto& hosted : hosted_) is_taken |= hosted->node().takes(event.channel);
    if (!is_taken) return;

    ++report_.fed;
    is_feeding_ = true;
    bus_.publish(event.channel, event.data);
    is_feeding_ = false;
    bus_.drain();
  }

  /// Stages without input would look like a drive without detections.
  [[noreturn]] void refuse_unfed() const {
    std::string channels;
    for (const std::string& channel : channels_) channels += " " + channel;
    std::string stages;
    for (const std::string& name : names_) stages += " " + name;
    throw io::LogError(options_.log.string() + ": no event of it is an input of the stages" +
                       stages + "; its channels:" + (channels.empty() ? " none" : channels) +
                       (report_.left_out == 0 ? "" : "; what these stages publish is left out"));
  }

  /// A recorded output of a hosted service, or its HEALTH, LOG or CONFIG.
  bool is_own_output(const io::LogEvent& event) const {
    if (outputs_.contains(event.channel)) return true;
    if (event.channel == "HEALTH") return is_from_hosted<health_t>(event);
    if (event.channel == "LOG") return is_from_hosted<log_t>(event);
    if (event.channel == "CONFIG") return is_from_hosted<config_t>(event);
    return false;
  }
  template <class Message>
  bool is_from_hosted(const io::LogEvent& event) const {
    const auto message = wire::decode_bytes<Message>(event.data);
    return message && names_.contains(message->process);
  }

  void record_derived(const BusMessage& message) {
    if (is_feeding_) return;
    ++report_.derived;
    if (writer_) writer_->write(log_utime_, message.channel, message.bytes);
  }

  double part_done() const {
    const auto size = static_cast<double>(std::max<std::uint64_t>(reader_.size_bytes(), 1));
    return static_cast<double>(reader_.position_bytes()) / size;
  }

  const ReplayOptions& options_;
  io::LcmLogReader reader_;
  std::optional<io::LcmLogWriter> writer_;
  MemoryBus bus_;
  std::vector<std::unique_ptr<HostedService>> hosted_;
  std::set<std::string, std::less<>> outputs_;
  std::set<std::string, std::less<>> names_;
  std::set<std::string>
      channels_;  ///< Channels up to the first event handled, for the error message.
  std::int64_t log_utime_ = 0;
  bool is_feeding_ = false;
  ReplayReport report_;
};

}  // namespace

ReplayReport replay(const ReplayOptions& options) { return Replay(options).run(); }

}  // namespace understory::bus
