#include "services/ekf/adapter.hpp"

#include <memory>
#include <optional>

#include "services/ekf/adapter_parameters.hpp"
#include "services/ekf/ekf.hpp"

namespace understory {
namespace {

class EkfAdapter : public Adapter {
 public:
  explicit EkfAdapter(EkfChannels channels) : channels_(std::move(channels)) {}

  void describe(ParameterTable& table) override { understory::describe(parameters_, table); }

  void bind(Node& node) override {
    node_ = &node;
    stage_.emplace(parameters_);
    // Each piece that is shed is a gap in the motion: a long queue.
    node.subscribe<Odometry>(channels_.odometry,
                             [this](const Odometry& piece) { publish(stage_->add(piece)); },
                             {.queue_size = 2000});
    node.subscribe<TrackedScan>(channels_.tracked_landmarks,
                                [this](const TrackedScan& scan) { publish(stage_->add(scan)); },
                                {.queue_size = 200});
    poses_ = node.advertise<EkfPose>(channels_.pose);
    maps_ = node.advertise<EkfMap>(channels_.map);
    levels_ = node.advertise<EkfLevel>(channels_.level);
    corrections_ = node.advertise<VelocityCorrection>(channels_.velocity_correction);
  }

  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  void publish(const EkfOutput& output) {
    const EkfCounters& counters = stage_->counters();
    if (counters.restarts != restarts_) {
      restarts_ = counters.restarts;
      node_->log(Node::Level::kWarning, "ekf_restart", counters.last_reason, channels_.pose);
    }
    if (output.level) levels_.publish(*output.level);
    if (output.pose) poses_.publish(*output.pose);
    if (output.map) maps_.publish(*output.map);
    if (output.correction) corrections_.publish(*output.correction);
  }

  EkfChannels channels_;
  EkfParameters parameters_;
  Node* node_ = nullptr;
  std::optional<Ekf> stage_;
  std::uint64_t restarts_ = 0;
  Publisher<EkfPose> poses_;
  Publisher<EkfMap> maps_;
  Publisher<EkfLevel> levels_;
  Publisher<VelocityCorrection> corrections_;
};

}  // namespace

Service ekf_service(const EkfChannels& channels) {
  return {"ekf",
          channels.odometry + ", " + channels.tracked_landmarks + " -> " + channels.pose + ", " +
              channels.map + ", " + channels.level + ", " + channels.velocity_correction,
          [channels] { return std::make_unique<EkfAdapter>(channels); }};
}

}  // namespace understory
