#include "services/ekf/adapter.hpp"

#include <memory>

#include "common/bus/watched_adapter.hpp"
#include "services/ekf/adapter_parameters.hpp"
#include "services/ekf/ekf.hpp"
#include "services/ekf/health_watch.hpp"

namespace understory::ekf {
namespace {

class EkfAdapter : public bus::WatchedAdapter<Ekf, EkfParameters, HealthWatch, HealthParameters> {
 public:
  explicit EkfAdapter(EkfChannels channels)
      : WatchedAdapter({"ekf_service", 3}), channels_(std::move(channels)) {}

  void bind(bus::Node& node) override {
    begin(node, parameters_);
    // An increment that the queue drops is a gap in the motion: the queue is long.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& increment) { add(increment); },
                                    {.queue_size = 2000});
    node.subscribe<model::TrackedScan>(channels_.tracked_landmarks,
                                       [this](const model::TrackedScan& scan) { add(scan); },
                                       {.queue_size = 200, .most_bytes = most_bytes()});
    node.subscribe<model::RawPose>(channels_.raw_pose,
                                   [this](const model::RawPose& pose) { stage_->add(pose); },
                                   {.queue_size = 2000});
    poses_ = node.advertise<model::EkfPose>(channels_.pose);
    maps_ = node.advertise<model::EkfMap>(channels_.map);
    levels_ = node.advertise<model::EkfLevel>(channels_.level);
    corrections_ = node.advertise<model::VelocityCorrection>(channels_.velocity_correction);
  }

 private:
  template <class Message>
  void add(const Message& message) {
    const EkfCounters before = stage_->counters();
    const EkfOutput output = stage_->add(message);
    watch_.add(output, before, stage_->counters());
    publish(output);
    show_health();
  }

  std::size_t most_bytes() const {
    return wire::bytes_with<tracked_landmarks_t, tracked_landmark_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  void publish(const EkfOutput& output) {
    const EkfCounters counters = stage_->counters();
    if (counters.restarts != restarts_) {
      restarts_ = counters.restarts;
      node_->report(wire::Reason::kRestarted, counters.last_reason, channels_.pose);
    }
    if (output.is_late) return;
    if (output.level) levels_.publish(*output.level);
    if (output.pose) poses_.publish(*output.pose);
    if (output.map) maps_.publish(*output.map);
    if (output.correction) corrections_.publish(*output.correction);
  }

  EkfChannels channels_;
  std::uint64_t restarts_ = 0;
  bus::Publisher<model::EkfPose> poses_;
  bus::Publisher<model::EkfMap> maps_;
  bus::Publisher<model::EkfLevel> levels_;
  bus::Publisher<model::VelocityCorrection> corrections_;
};

}  // namespace

bus::Service ekf_service(const EkfChannels& channels) {
  return {"ekf", channels.all, [channels] { return std::make_unique<EkfAdapter>(channels); }};
}

}  // namespace understory::ekf
