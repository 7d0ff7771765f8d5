#include "services/keyframer/adapter.hpp"

#include <memory>

#include "services/keyframer/adapter_parameters.hpp"
#include "services/keyframer/keyframer.hpp"

namespace understory {
namespace {

class KeyframerAdapter : public Adapter {
 public:
  explicit KeyframerAdapter(KeyframerChannels channels) : channels_(std::move(channels)) {}

  void describe(ParameterTable& table) override { understory::describe(parameters_, table); }

  void bind(Node& node) override {
    stage_ = make_keyframer(parameters_);
    node.subscribe<LandmarkScan>(channels_.landmarks,
                                 [this](const LandmarkScan& scan) {
                                   if (const auto keyframe = stage_->add(scan))
                                     keyframes_.publish(*keyframe);
                                 },
                                 {.queue_size = 200});
    // Small, and each one that is shed breaks the chain of motion: a long queue.
    node.subscribe<Odometry>(channels_.odometry,
                             [this](const Odometry& motion) { stage_->add(motion); },
                             {.queue_size = 2000});
    // Of the filter's words the bias and the velocity: its pose was made from the same detections.
    node.subscribe<EkfPose>(channels_.ekf_pose, [this](const EkfPose& pose) { stage_->add(pose); });
    node.subscribe<EkfLevel>(channels_.ekf_level,
                             [this](const EkfLevel& level) { stage_->add(level); });
    keyframes_ = node.advertise<Keyframe>(channels_.keyframe);
  }

  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  KeyframerChannels channels_;
  KeyframerParameters parameters_;
  std::unique_ptr<KeyframerMethod> stage_;
  Publisher<Keyframe> keyframes_;
};

}  // namespace

Service keyframer_service(const KeyframerChannels& channels) {
  return {"keyframer",
          channels.landmarks + ", " + channels.odometry + ", " + channels.ekf_pose + ", " +
              channels.ekf_level + " -> " + channels.keyframe,
          [channels] { return std::make_unique<KeyframerAdapter>(channels); }};
}

}  // namespace understory
