#include "services/associator/adapter.hpp"

#include <memory>
#include <optional>

#include "services/associator/adapter_parameters.hpp"
#include "services/associator/associator.hpp"

namespace understory::associator {
namespace {

class AssociatorAdapter : public bus::Adapter {
 public:
  explicit AssociatorAdapter(AssociatorChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override { associator::describe(parameters_, table); }

  void bind(bus::Node& node) override {
    stage_.emplace(parameters_);

    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) {
                                          if (const auto tracked = stage_->add(scan))
                                            tracked_.publish(*tracked);
                                        },
                                        {.queue_size = 200, .most_bytes = most_bytes()});
    // A lost increment is a gap in the motion: a long queue.
    node.subscribe<model::Odometry>(
        channels_.odometry, [this](const model::Odometry& increment) { stage_->add(increment); },
        {.queue_size = 2000});
    node.subscribe<model::EkfPose>(channels_.filter_pose,
                                   [this](const model::EkfPose& pose) { stage_->add(pose); });

    tracked_ = node.advertise<model::TrackedScan>(channels_.tracked_landmarks);
  }

  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  std::size_t most_bytes() const {
    return wire::bytes_with<landmarks_t, detection_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  AssociatorChannels channels_;
  AssociatorParameters parameters_;
  std::optional<Associator> stage_;
  bus::Publisher<model::TrackedScan> tracked_;
};

}  // namespace

bus::Service associator_service(const AssociatorChannels& channels) {
  return {"associator",
          channels.landmarks + ", " + channels.odometry + ", " + channels.filter_pose + " -> " +
              channels.tracked_landmarks,
          [channels] { return std::make_unique<AssociatorAdapter>(channels); }};
}

}  // namespace understory::associator
