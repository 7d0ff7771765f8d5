#include "services/loop_closer/adapter.hpp"

#include <fmt/format.h>

#include <memory>

#include "common/bus/watched_adapter.hpp"
#include "services/loop_closer/adapter_parameters.hpp"
#include "services/loop_closer/health_watch.hpp"
#include "services/loop_closer/loop_closer.hpp"
#include "services/loop_closer/place_search.hpp"

namespace understory::loop_closer {
namespace {

class LoopCloserAdapter
    : public bus::WatchedAdapter<LoopCloser, LoopCloserParameters, HealthWatch, HealthParameters> {
 public:
  explicit LoopCloserAdapter(LoopCloserChannels channels)
      : WatchedAdapter({"loop_closer_service", 2}), channels_(std::move(channels)) {}

  void bind(bus::Node& node) override {
    if (const std::string fault = fault_of(parameters_.search); !fault.empty())
      throw bus::ConfigurationError({fault});
    begin(node, parameters_);

    // A search sometimes takes longer than the interval of keyframes: long queues.
    node.subscribe<model::Keyframe>(
        channels_.keyframe, [this](const model::Keyframe& keyframe) { stage_->add(keyframe); },
        {.queue_size = 500});
    node.subscribe<model::PlaceScan>(channels_.place_scan,
                                     [this](const model::PlaceScan& scan) { stage_->add(scan); },
                                     {.queue_size = 100});
    node.subscribe<model::MapUpdate>(channels_.slam_update,
                                     [this](const model::MapUpdate& update) { add(update); },
                                     {.queue_size = 500});
    // Repeated until a store confirms it: it may arrive twice.
    node.subscribe<model::Submap>(channels_.submap,
                                  [this](const model::Submap& submap) { stage_->add(submap); },
                                  {.queue_size = 200, .timed = false});
    node.subscribe<model::LoopResult>(channels_.loop_result,
                                      [this](const model::LoopResult& result) { add(result); },
                                      {.queue_size = 200, .timed = false});
    closures_ = node.advertise<model::LoopClosure>(channels_.loop_closure);
  }

 private:
  void add(const model::MapUpdate& update) {
    const LoopCounters before = stage_->counters();
    if (const auto closure = stage_->add(update)) {
      closures_.publish(*closure);
      log(*closure);
    }
    watch_.add(before, stage_->counters());
    show_health();
  }

  void add(const model::LoopResult& result) {
    if (!stage_->add(result)) return;
    watch_.add(result);
    show_health();
  }

  void log(const model::LoopClosure& closure) {
    const std::string from = closure.from.submap != 0
                                 ? fmt::format("submap {}", closure.from.submap)
                                 : fmt::format("keyframe {}", closure.from.keyframe);
    const std::string chance =
        closure.log10_false_alarm < 0.0
            ? fmt::format("by chance with 10^{:.0f}", closure.log10_false_alarm)
            : fmt::format("by {}", closure.source);
    node_->log(bus::Node::Level::kInfo, "loop",
               fmt::format("closure {}: keyframe {} is at {}, {}", closure.id, closure.to.keyframe,
                           from, chance),
               channels_.loop_closure);
  }

  LoopCloserChannels channels_;
  bus::Publisher<model::LoopClosure> closures_;
};

}  // namespace

bus::Service loop_closer_service(const LoopCloserChannels& channels) {
  return {"loop_closer", channels.all,
          [channels] { return std::make_unique<LoopCloserAdapter>(channels); }};
}

}  // namespace understory::loop_closer
