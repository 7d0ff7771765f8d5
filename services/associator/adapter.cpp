#include "services/associator/adapter.hpp"

#include <memory>
#include <optional>

#include "services/associator/adapter_parameters.hpp"
#include "services/associator/associator.hpp"
#include "services/associator/health_watch.hpp"

namespace understory::associator {
namespace {

constexpr state::Format kServiceFormat{"associator_service", 2};

class AssociatorAdapter : public bus::Adapter {
 public:
  explicit AssociatorAdapter(AssociatorChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    associator::describe(parameters_, table);
    associator::describe(health_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    stage_.emplace(parameters_);
    watch_ = HealthWatch(health_);

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
  void add(const model::LandmarkScan& scan) {
    const AssociatorCounters before = stage_->counters();
    const auto tracked = stage_->add(scan);
    watch_.add(scan, before, stage_->counters(), stage_->is_noise_misstated());
    if (tracked) tracked_.publish(*tracked);
    show_health();
  }

  void show_health() {
    for (const bus::WatchedCondition& one : watch_.conditions()) node_->show(one);
  }

  std::size_t most_bytes() const {
    return wire::bytes_with<landmarks_t, detection_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  AssociatorChannels channels_;
  AssociatorParameters parameters_;
  HealthParameters health_;
  HealthWatch watch_;
  bus::Node* node_ = nullptr;
  std::optional<Associator> stage_;
  bus::Publisher<model::TrackedScan> tracked_;
};

}  // namespace

bus::Service associator_service(const AssociatorChannels& channels) {
  return {"associator", channels.all,
          [channels] { return std::make_unique<AssociatorAdapter>(channels); }};
}

}  // namespace understory::associator
