#include "services/viewer/adapter.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/bus/device.hpp"
#include "common/model/program_version.hpp"
#include "services/viewer/adapter_parameters.hpp"
#include "services/viewer/page_bundle.hpp"
#include "services/viewer/page_host.hpp"
#include "services/viewer/process_watch.hpp"
#include "services/viewer/run.hpp"
#include "understory/map_request_t.hpp"

namespace understory::viewer {
namespace {

constexpr int kWait_ms = 20;
constexpr std::int64_t kWatchEvery_us = 200'000;

class ViewerAdapter : public bus::Adapter, public bus::Device {
 public:
  explicit ViewerAdapter(ViewerChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override { viewer::describe(parameters_, table); }

  void bind(bus::Node& node) override {
    node_ = &node;
    requests_ = node.advertise<map_request_t>(channels_.map_request);
    for_each_channel([this]<class T>(const char* channel, const ChannelTraits& traits, auto take) {
      if (traits.is_bulk && !parameters_.hears_sweeps) return;
      node_->subscribe<T>(channel,
                          [this, channel, take](const T& value) { hear(channel, value, take); },
                          {.queue_size = traits.is_bulk ? std::size_t{400} : std::size_t{100},
                           .sequenced = !traits.is_from_many,
                           .timed = traits.is_on_message_time,
                           .journaled = false});
    });
  }

  void open() override {
    ::setpriority(PRIO_PROCESS, 0, parameters_.niceness);
    PageRequests requests;
    requests.story = [this](const nlohmann::json& question) { return run_.answer(question); };
    host_.emplace(parameters_.page, std::vector<const Scene*>{&run_.scene()}, std::move(requests),
                  nlohmann::ordered_json{{"version", model::program_version()},
                                         {"mode", "live"},
                                         {"runs", {{{"name", "live"}, {"colour_index", 0}}}}});
    const std::string page =
        host_->url() + (has_page() ? "" : " (the page was not built: see the build's output)");
    node_->log(bus::Node::Level::kInfo, "page", page);
    std::cerr << "viewer: " << page << '\n';
  }

  std::vector<int> file_descriptors() const override { return {host_->file_descriptor()}; }
  int wait_ms() const override { return kWait_ms; }

  void attend(std::int64_t monotonic_us) override {
    if (monotonic_us - attended_us_ < kAttendEvery_us) return;
    attended_us_ = monotonic_us;
    const std::int64_t wall_us = clock_.wall_us();
    if (parameters_.watches_processes && monotonic_us - watched_us_ >= kWatchEvery_us) {
      watched_us_ = monotonic_us;
      watch(wall_us);
    }
    run_.scene().look(wall_us);
    host_->attend(monotonic_us);
    if (run_.scene().wants_map() && !run_.scene().processes().entries().empty())
      ask_for_map(monotonic_us);
    report_refused();
  }

 private:
  static constexpr std::int64_t kAttendEvery_us = 5'000;
  static constexpr std::int64_t kAskAgain_us = 5'000'000;

  template <class T, class Take>
  void hear(const char* channel, const T& value, const Take& take) {
    if (!host_) return;  // No page in a replay.
    const std::int64_t wall_us = clock_.wall_us();
    run_.take(value, take, wall_us);
    if (host_->foxglove().wants(channel))
      host_->foxglove().hear(channel, wire::encode_message(value), wall_us);
  }

  void watch(std::int64_t wall_us) {
    // take() changes the board: copies the names first.
    std::vector<std::pair<std::string, std::int64_t>> processes;
    for (const auto& [name, entry] : run_.scene().processes().entries())
      processes.emplace_back(name, entry.health.pid);
    for (const auto& [name, pid] : processes) {
      if (pid <= 0) continue;  // HEALTH sent by the supervisor for a process that it gave up.
      run_.scene().processes().take(name, look_at_process(pid), wall_us);
    }
  }

  /// A late subscriber has missed MAP.
  void ask_for_map(std::int64_t monotonic_us) {
    if (monotonic_us - asked_us_ < kAskAgain_us) return;
    asked_us_ = monotonic_us;
    map_request_t request{};
    request.utime = std::max<model::Utime>(0, node_->now());
    request.everything = 1;
    requests_.publish(request);
  }

  void report_refused() {
    const std::uint64_t refused = host_->counts().refused();
    // Logged only when the count has doubled: a flood does not fill LOG.
    if (refused == 0 || refused < 2 * refused_) return;
    node_->report(
        wire::Reason::kClientRefused,
        fmt::format(
            "{} connections or messages of web clients were refused so far (see {}health.json)",
            refused, host_->url()));
    refused_ = refused;
  }

  ViewerChannels channels_;
  ViewerParameters parameters_;
  bus::Publisher<map_request_t> requests_;
  bus::Clock clock_ = bus::system_clock();
  bus::Node* node_ = nullptr;
  Run run_;
  std::optional<PageHost> host_;
  std::int64_t attended_us_ = 0;
  std::int64_t asked_us_ = -kAskAgain_us;
  std::int64_t watched_us_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace

bus::ChannelList shown_channels() {
  bus::ChannelList list("", "a web page, and the Foxglove protocol");
  for_each_channel([&]<class T>(const char* channel, const ChannelTraits& traits, auto /*take*/) {
    if (traits.is_bulk) list.in_if(channel, "shown where input.sweeps is true");
    if (!traits.is_bulk) list.in(channel, "shown on the page, or passed on to Foxglove");
  });
  return list;
}

bus::Service viewer_service(const ViewerChannels& channels) {
  return {"viewer", channels.all, [channels] { return std::make_unique<ViewerAdapter>(channels); }};
}

}  // namespace understory::viewer
