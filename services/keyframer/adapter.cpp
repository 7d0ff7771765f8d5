#include "services/keyframer/adapter.hpp"

#include <memory>

#include "services/keyframer/adapter_parameters.hpp"
#include "services/keyframer/keyframer.hpp"

namespace understory::keyframer {
namespace {

class KeyframerAdapter : public bus::Adapter {
 public:
  explicit KeyframerAdapter(KeyframerChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override { keyframer::describe(parameters_, table); }

  void bind(bus::Node& node) override {
    stage_ = make_keyframer(parameters_);

    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) {
                                          if (const auto keyframe = stage_->add(scan))
                                            keyframes_.publish(*keyframe);
                                        },
                                        {.queue_size = 200, .most_bytes = most_bytes()});
    // Increments are small, and a lost one breaks the chain of motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) { stage_->add(motion); },
                                    {.queue_size = 2000});
    // Bias and velocity are used, the pose is not: it was estimated from the same detections.
    node.subscribe<model::EkfPose>(channels_.ekf_pose,
                                   [this](const model::EkfPose& pose) { stage_->add(pose); });
    node.subscribe<model::EkfLevel>(channels_.ekf_level,
                                    [this](const model::EkfLevel& level) { stage_->add(level); });

    keyframes_ = node.advertise<model::Keyframe>(channels_.keyframe);
  }

  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  std::size_t most_bytes() const {
    return wire::bytes_with<landmarks_t, detection_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  KeyframerChannels channels_;
  KeyframerParameters parameters_;
  std::unique_ptr<KeyframerMethod> stage_;
  bus::Publisher<model::Keyframe> keyframes_;
};

}  // namespace

bus::Service keyframer_service(const KeyframerChannels& channels) {
  return {"keyframer",
          channels.landmarks + ", " + channels.odometry + ", " + channels.ekf_pose + ", " +
              channels.ekf_level + " -> " + channels.keyframe,
          [channels] { return std::make_unique<KeyframerAdapter>(channels); }};
}

}  // namespace understory::keyframer
