#include "services/ekf/adapter.hpp"

#include <memory>
#include <optional>

#include "services/ekf/adapter_parameters.hpp"
#include "services/ekf/ekf.hpp"
#include "services/ekf/health_watch.hpp"

namespace understory::ekf {
namespace {

constexpr state::Format kServiceFormat{"ekf_service", 3};

class EkfAdapter : public bus::Adapter {
 public:
  explicit EkfAdapter(EkfChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    ekf::describe(parameters_, table);
    ekf::describe(health_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    stage_.emplace(parameters_);
    watch_ = HealthWatch(health_);
    // A dropped increment is a gap in the motion: a long queue.
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

  std::string save() const override { return state::save(kServiceFormat, watch_, stage_->save()); }

  void load(const std::string& state) override {
    HealthWatch watch(health_);
    std::string stage;
    state::load(state, kServiceFormat, watch, stage);
    stage_->load(stage);
    watch_ = watch;
    show_health();
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

  void show_health() {
    for (const bus::WatchedCondition& one : watch_.conditions()) node_->show(one);
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
  EkfParameters parameters_;
  HealthParameters health_;
  HealthWatch watch_;
  bus::Node* node_ = nullptr;
  std::optional<Ekf> stage_;
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
