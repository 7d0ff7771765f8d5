#include "services/associator/adapter.hpp"

#include <memory>
#include <optional>

#include "services/associator/adapter_parameters.hpp"
#include "services/associator/associator.hpp"

namespace understory {
namespace {

class AssociatorAdapter : public Adapter {
 public:
  explicit AssociatorAdapter(AssociatorChannels channels) : channels_(std::move(channels)) {}

  void describe(ParameterTable& table) override { understory::describe(parameters_, table); }

  void bind(Node& node) override {
    stage_.emplace(parameters_);
    node.subscribe<LandmarkScan>(channels_.landmarks,
                                 [this](const LandmarkScan& scan) {
                                   if (const auto tracked = stage_->add(scan))
                                     tracked_.publish(*tracked);
                                 },
                                 {.queue_size = 200});
    // Each piece that is shed is a gap in the motion: a long queue.
    node.subscribe<Odometry>(channels_.odometry,
                             [this](const Odometry& piece) { stage_->add(piece); },
                             {.queue_size = 2000});
    node.subscribe<EkfPose>(channels_.filter_pose,
                            [this](const EkfPose& pose) { stage_->add(pose); });
    tracked_ = node.advertise<TrackedScan>(channels_.tracked_landmarks);
  }

  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  AssociatorChannels channels_;
  AssociatorParameters parameters_;
  std::optional<Associator> stage_;
  Publisher<TrackedScan> tracked_;
};

}  // namespace

Service associator_service(const AssociatorChannels& channels) {
  return {"associator",
          channels.landmarks + ", " + channels.odometry + ", " + channels.filter_pose + " -> " +
              channels.tracked_landmarks,
          [channels] { return std::make_unique<AssociatorAdapter>(channels); }};
}

}  // namespace understory
