#include "services/associator/adapter.hpp"

#include <memory>

#include "common/bus/watched_adapter.hpp"
#include "services/associator/adapter_parameters.hpp"
#include "services/associator/associator.hpp"
#include "services/associator/health_watch.hpp"

namespace understory::associator {
namespace {

class AssociatorAdapter
    : public bus::WatchedAdapter<Associator, AssociatorParameters, HealthWatch, HealthParameters> {
 public:
  explicit AssociatorAdapter(AssociatorChannels channels)
      : WatchedAdapter({"associator_service", 2}), channels_(std::move(channels)) {}

  void bind(bus::Node& node) override {
    begin(node, parameters_);

    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) { add(scan); },
                                        {.queue_size = 200, .most_bytes = most_bytes()});
    // A lost increment is a gap in the motion: a long queue.
    node.subscribe<model::Odometry>(
        channels_.odometry, [this](const model::Odometry& increment) { stage_->add(increment); },
        {.queue_size = 2000});
    node.subscribe<model::EkfPose>(channels_.filter_pose,
                                   [this](const model::EkfPose& pose) { stage_->add(pose); });

    tracked_ = node.advertise<model::TrackedScan>(channels_.tracked_landmarks);
  }

 private:
  void add(const model::LandmarkScan& scan) {
    const AssociatorCounters before = stage_->counters();
    const auto tracked = stage_->add(scan);
    watch_.add(scan, before, stage_->counters(), stage_->is_noise_misstated());
    if (tracked) tracked_.publish(*tracked);
    show_health();
  }

  std::size_t most_bytes() const {
    return wire::bytes_with<landmarks_t, detection_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  AssociatorChannels channels_;
  bus::Publisher<model::TrackedScan> tracked_;
};

}  // namespace

bus::Service associator_service(const AssociatorChannels& channels) {
  return {"associator", channels.all,
          [channels] { return std::make_unique<AssociatorAdapter>(channels); }};
}

}  // namespace understory::associator
