#include "services/existence_tracker/adapter.hpp"

#include <fmt/format.h>

#include <memory>

#include "services/existence_tracker/adapter_parameters.hpp"
#include "services/existence_tracker/existence_tracker.hpp"
#include "services/existence_tracker/start_states.hpp"
#include "understory/map_request_t.hpp"

namespace understory::existence_tracker {
namespace {

constexpr state::Format kServiceFormat{"existence_tracker_service", 1};
/// Message time between requests for the whole map.
constexpr model::Utime kAskAgain_us = 5'000'000;

/// The map at the start of the drive; the same as the mapper's.
struct InputParameters {
  std::string map_file;
  int map_id = 0;
  int max_map_landmarks = 200'000;
};

class TrackerAdapter : public bus::Adapter {
 public:
  explicit TrackerAdapter(TrackerChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    existence_tracker::describe(parameters_, table);
    table.add("input.map_file", input_.map_file, {},
              "Map file to begin with, the same as the mapper's (see understory map); the "
              "existence states of its landmarks are continued.");
    table.add("input.map_id", input_.map_id, {0, 32767}, "",
              "Number of the map in that file; 0: the only one.");
    table.add("input.max_map_landmarks", input_.max_map_landmarks, {1, 10'000'000}, "",
              "Larger maps are refused.");
    bus::describe(limits_, "missing", "keyframes",
                  "those with a landmark whose position is not known.", table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    stage_ = std::make_unique<ExistenceTracker>(parameters_);
    missing_.condition = bus::Condition(limits_);
    if (!input_.map_file.empty())
      stage_->begin_with(read_start_states(input_.map_file, input_.map_id));
    subscribe(node);
    existence_ = node.advertise<model::Existence>(channels_.existence);
    states_ = node.advertise<model::ExistenceState>(channels_.existence_state);
    requests_ = node.advertise<map_request_t>(channels_.map_request);
    node.every(static_cast<model::Utime>(parameters_.output.state_period_s * 1e6),
               [this](model::Utime /*now*/) { publish_states(); });
  }

  void finish() override { publish_states(); }

  std::string save() const override {
    return state::save(kServiceFormat, missing_, stage_->save());
  }
  void load(const std::string& state) override {
    bus::WatchedCondition missing = missing_;
    std::string stage;
    state::load(state, kServiceFormat, missing, stage);
    stage_->load(stage);
    missing_ = missing;
    node_->show(missing_);
  }

 private:
  void subscribe(bus::Node& node) {
    const auto landmarks = static_cast<std::size_t>(input_.max_map_landmarks);
    const bus::SubscribeOptions options{
        .queue_size = 200, .most_bytes = 2 * wire::bytes_with<map_t, map_landmark_t>(landmarks)};
    node.subscribe<model::WholeMap>(
        channels_.map, [this](const model::WholeMap& map) { stage_->on_map(map); }, options);
    node.subscribe<model::MapDelta>(
        channels_.map_delta, [this](const model::MapDelta& delta) { stage_->on_delta(delta); },
        options);
    node.subscribe<model::MapUpdate>(channels_.slam_update,
                                     [this](const model::MapUpdate& update) { on_update(update); },
                                     {.queue_size = 500});
  }

  void on_update(const model::MapUpdate& update) {
    const TrackerCounters before = stage_->counters();
    const auto existence = stage_->on_update(update);
    if (!existence) return;
    existence_.publish(*existence);
    log(*existence, before);

    missing_.condition.add(stage_->counters().without_place > before.without_place);
    node_->show(missing_);
    if (stage_->wants_map()) ask(update.utime);
  }

  void log(const model::Existence& existence, const TrackerCounters& before) {
    const TrackerCounters& now = stage_->counters();
    if (now.dropped > before.dropped || now.readmitted > before.readmitted)
      node_->log(bus::Node::Level::kInfo, "existence",
                 fmt::format("{} landmarks taken for gone, {} in use again; {} of {} not in use",
                             now.dropped - before.dropped, now.readmitted - before.readmitted,
                             existence.unused, existence.known),
                 channels_.existence);
    if (existence.is_mapping_needed == is_mapping_needed_) return;
    is_mapping_needed_ = existence.is_mapping_needed;
    if (is_mapping_needed_)
      node_->log(
          bus::Node::Level::kInfo, "mapping_needed",
          fmt::format("{:.0f} % of the landmarks are missing, {:.0f} % of what is seen is new",
                      100.0 * existence.missing_share, 100.0 * existence.new_share),
          channels_.existence);
  }

  void ask(model::Utime now) {
    if (asked_ >= 0 && now - asked_ < kAskAgain_us && now >= asked_) return;
    asked_ = now;
    map_request_t request{};
    request.utime = now;
    request.everything = 1;
    requests_.publish(request);
  }

  void publish_states() {
    for (const model::ExistenceState& state : stage_->take_states()) states_.publish(state);
  }

  TrackerChannels channels_;
  TrackerParameters parameters_;
  InputParameters input_;
  bus::ConditionLimits limits_{20, 10};
  bus::WatchedCondition missing_{wire::Reason::kPartsMissing,
                                 "the mapper tells of landmarks whose place is not known",
                                 "MAP_DELTA", bus::Condition(limits_)};
  bus::Node* node_ = nullptr;
  std::unique_ptr<ExistenceTracker> stage_;
  bool is_mapping_needed_ = false;  ///< As last logged.
  model::Utime asked_ = -1;         ///< Time of the last request for the whole map.
  bus::Publisher<model::Existence> existence_;
  bus::Publisher<model::ExistenceState> states_;
  bus::Publisher<map_request_t> requests_;
};

}  // namespace

bus::Service existence_tracker_service(const TrackerChannels& channels) {
  return {"existence_tracker", channels.all,
          [channels] { return std::make_unique<TrackerAdapter>(channels); }};
}

}  // namespace understory::existence_tracker
