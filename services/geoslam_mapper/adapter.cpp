#include "services/geoslam_mapper/adapter.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "services/geoslam_mapper/adapter_parameters.hpp"
#include "services/geoslam_mapper/given_map.hpp"
#include "services/geoslam_mapper/health_watch.hpp"
#include "services/geoslam_mapper/lines_of_sight.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "services/geoslam_mapper/pose_stream.hpp"
#include "services/geoslam_mapper/published_map.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/geoslam_mapper/submap_exchange.hpp"
#include "understory/map_request_t.hpp"

namespace understory::geoslam_mapper {
namespace {

/// Members that fit into a KEYFRAME beside its landmarks; usually there are 8.
constexpr std::size_t kMembers = 64;
/// Assumed number of members that detected each landmark.
constexpr std::size_t kUsualMembers = 16;

/// Bytes of a SUBMAP with this number of landmarks: its keyframes and its payload double the size.
std::size_t submap_bytes(std::size_t landmarks) {
  return 8 * wire::bytes_with<submap_t, map_landmark_t>(landmarks);
}
/// Most landmarks of one stretch of the path.
constexpr std::size_t kSubmapLandmarks = 2000;

constexpr state::Format kFormat{"geoslam_mapper", 10};

/// State between the mapper and the bus: the parts compute, the adapter only connects them.
struct Parts {
  PublishedMap map;
  PoseStream poses;
  SubmapExchange exchange;
  HealthWatch health;
  LinesOfSight sights;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.map, s.poses, s.exchange, s.health, s.sights);
  }
};

class MapperAdapter : public bus::Adapter {
 public:
  explicit MapperAdapter(MapperChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    geoslam_mapper::describe(parameters_, table);
    geoslam_mapper::describe(input_, table);
    geoslam_mapper::describe(output_, table);
    geoslam_mapper::describe(health_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    stage_.emplace(parameters_);
    parts_ = empty_parts();
    if (!input_.map_file.empty()) begin_with(read_given_map(input_.map_file, input_.map_id));
    subscribe(node);
    advertise(node);
    node.every(static_cast<model::Utime>(output_.map_period_s * 1e6), [this](model::Utime /*now*/) {
      if (parts_->map.is_due()) publish_map();
    });
  }

  void finish() override {
    if (parts_->map.has_changed()) publish_map();
    publish_correction(parts_->map.utime(), true);
  }

  std::string save() const override { return state::save(kFormat, *parts_, stage_->save()); }

  void load(const std::string& state) override {
    Parts parts = empty_parts();
    std::string stage;
    state::load(state, kFormat, parts, stage);
    stage_->load(stage);
    parts_ = std::move(parts);
    parts_->poses.rebuild();
    show_health();
  }

  void state_was_lost(std::int64_t written_s) override {
    const NumbersAfterLoss first = numbers_after_loss(written_s);
    parts_->poses.begin_behind(first.resets);
    // A given map has a number already.
    if (parts_->map.map_id() == 0) stage_->begin_with_number(first.map_id);
  }

 private:
  Parts empty_parts() const {
    return {PublishedMap({output_.moved_m, output_.reset_distance_m, output_.map_share}),
            PoseStream({output_.reset_distance_m, output_.reset_angle_rad, output_.oldest_pose_s}),
            {},
            HealthWatch(health_),
            {}};
  }

  void subscribe(bus::Node& node) {
    const auto most_landmarks = static_cast<std::size_t>(input_.max_keyframe_landmarks);
    const auto most_detections = static_cast<std::size_t>(input_.max_detections);
    node.subscribe<model::Keyframe>(
        channels_.keyframe, [this](const model::Keyframe& one) { on_keyframe(one); },
        {.queue_size = 200,
         .most_bytes =
             wire::bytes_with<keyframe2_t, keyframe_landmark_t>(most_landmarks) +
             kMembers * wire::element_bytes<keyframe_member_t>() +
             kUsualMembers * most_landmarks * wire::element_bytes<keyframe_detection_t>()});

    // Not in the journal: a scan does not change the map, and the next one is localised
    // independently.
    node.subscribe<model::LandmarkScan>(
        channels_.landmarks, [this](const model::LandmarkScan& scan) { on_scan(scan); },
        {.most_bytes = wire::bytes_with<landmarks_t, detection_t>(most_detections),
         .journaled = false});

    // SLAM_UPDATE depends on them: journaled.
    node.subscribe<model::ViewRanges>(
        channels_.view_ranges,
        [this](const model::ViewRanges& ranges) { parts_->sights.add(ranges); },
        {.queue_size = 100});

    // Small, but a lost increment is a gap in the motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) {
                                      stage_->add(motion);
                                      parts_->poses.on_odometry(motion);
                                    },
                                    {.queue_size = 2000});

    node.subscribe<model::RestLevel>(channels_.rest_level,
                                     [this](const model::RestLevel& level) { stage_->add(level); });

    // For gating only, not a measurement: it was made from the same detections.
    node.subscribe<model::EkfPose>(channels_.ekf_pose, [this](const model::EkfPose& pose) {
      stage_->add(pose);
      parts_->health.add(pose);
    });
    node.subscribe<model::EkfLevel>(channels_.ekf_level,
                                    [this](const model::EkfLevel& level) { stage_->add(level); });
    node.subscribe<map_request_t>(channels_.map_request,
                                  [this](const map_request_t& request) { on_request(request); },
                                  {.queue_size = 4, .sequenced = false, .journaled = false});

    // A map of another time, outside the sequence of messages.
    const auto most_given = static_cast<std::size_t>(input_.max_given_landmarks);
    node.subscribe<model::WholeMap>(channels_.given_map,
                                    [this](const model::WholeMap& map) { on_given(map); },
                                    {.queue_size = 2,
                                     .sequenced = false,
                                     .timed = false,
                                     .most_bytes = map_bytes(most_given, most_given)});
    subscribe_to_store(node);
  }

  void subscribe_to_store(bus::Node& node) {
    node.subscribe<model::SubmapStored>(channels_.submap_stored,
                                        [this](const model::SubmapStored& stored) {
                                          parts_->exchange.on_stored(stored);
                                          stage_->may_hand_over(parts_->exchange.keeps_up());
                                        },
                                        {.queue_size = 200});
    node.subscribe<model::Submap>(channels_.submap_reply,
                                  [this](const model::Submap& submap) { on_reply(submap); },
                                  {.queue_size = 50, .most_bytes = submap_bytes(kSubmapLandmarks)});

    // From any process that finds or sets a closure; each numbers its own. Part of the map:
    // journaled.
    node.subscribe<model::LoopClosure>(channels_.loop_closure,
                                       [this](const model::LoopClosure& one) { on_closure(one); },
                                       {.queue_size = 200, .sequenced = false, .timed = false});
    node.subscribe<model::Existence>(channels_.existence,
                                     [this](const model::Existence& one) { stage_->take(one); },
                                     {.queue_size = 200});
  }

  void on_closure(const model::LoopClosure& closure) {
    const model::LoopResult result = stage_->take(closure);
    parts_->health.add(result);
    results_.publish(result);
  }

  /// An answer may come twice: the second submap is no longer requested.
  void on_reply(const model::Submap& submap) {
    const std::vector<model::SubmapId> wanted = stage_->wanted();
    if (std::ranges::find(wanted, submap.id) == wanted.end()) return;
    const std::string refused = stage_->bring_back(submap);
    if (refused.empty()) return parts_->map.take_back(submap);
    node_->report(wire::Reason::kInputRefused, refused, channels_.submap_reply);
  }

  void exchange_submaps(model::Utime now) {
    std::vector<model::Submap> given_away = stage_->take_given_away();
    for (const model::Submap& submap : given_away) parts_->map.give_away(submap);
    const auto messages = parts_->exchange.on_keyframe(now, std::move(given_away), stage_->wanted(),
                                                       parts_->map.map_id());
    for (const model::Submap& submap : messages.submaps) parts_->map.earn(submaps_.publish(submap));
    for (const model::Submap& submap : messages.waited) on_reply(submap);
    if (!messages.query.ids.empty()) queries_.publish(messages.query);
    stage_->may_hand_over(parts_->exchange.keeps_up());
    parts_->health.keeps_up(parts_->exchange.keeps_up());
  }

  void publish_correction(model::Utime now, bool is_last) {
    if (!is_last && !parts_->exchange.is_correction_due(now)) return;
    if (const auto one = parts_->exchange.correction(stage_->submap_poses(), parts_->map, is_last))
      parts_->map.earn(corrections_.publish(*one));
  }

  /// Only before the first keyframe: an existing map is not replaced.
  void on_given(const model::WholeMap& map) {
    std::string reason = why_not_given(map);
    if (parts_->map.map_id() != 0) reason = "a map is there already";
    if (reason.empty()) return begin_with(map);
    node_->report(wire::Reason::kInputRefused, "a given map was not taken: " + reason,
                  channels_.given_map);
  }

  void begin_with(const model::WholeMap& map) {
    stage_->start_with(apart_from_keyframes(map, parameters_.given_map_sigma_m));
    (void)stage_->take_changed_landmarks();
    parts_->poses.begin_in(map);
    parts_->map.begin_with(stage_->landmarks());
    parts_->health.must_find_map();
  }

  void advertise(bus::Node& node) {
    poses_ = node.advertise<model::SlamPose>(channels_.slam_pose);
    updates_ = node.advertise<model::MapUpdate>(channels_.slam_update);
    maps_ = node.advertise<model::WholeMap>(channels_.map);
    deltas_ = node.advertise<model::MapDelta>(channels_.map_delta);
    submaps_ = node.advertise<model::Submap>(channels_.submap);
    queries_ = node.advertise<model::SubmapQuery>(channels_.submap_query);
    corrections_ = node.advertise<model::MapCorrection>(channels_.map_correction);
    results_ = node.advertise<model::LoopResult>(channels_.loop_result);
  }

  void on_keyframe(const model::Keyframe& keyframe) {
    model::MapUpdate update = stage_->add(keyframe);
    update.covariance += parts_->poses.given_covariance_at(update.map_T_vehicle, update.map_id);
    identify_detections(keyframe, update);
    parts_->sights.fill(keyframe, parts_->map.landmarks(), update);
    parts_->map.earn(updates_.publish(update));

    const bool is_new_map = parts_->map.is_another(update);
    publish_poses(keyframe, update, is_new_map);
    publish_delta(update, is_new_map);
    exchange_submaps(keyframe.utime);
    publish_correction(keyframe.utime, false);
    parts_->health.add(update);
    show_health();
  }

  void show_health() {
    for (const bus::WatchedCondition& one : parts_->health.conditions()) node_->show(one);
  }

  /// Publishes the pose of a scan at once, in the present map; its keyframe comes later.
  void on_scan(const model::LandmarkScan& scan) {
    const std::optional<ScanPose> found = stage_->locate(scan);
    parts_->health.add_scan(found && found->is_coasting);
    show_health();
    if (const auto pose = parts_->poses.on_scan(scan, found, parts_->map.map_id()))
      poses_.publish(*pose);
  }

  void publish_poses(const model::Keyframe& keyframe, const model::MapUpdate& update,
                     bool is_new_map) {
    const auto made = parts_->poses.on_keyframe(keyframe, update, is_new_map);
    const auto bytes = static_cast<std::size_t>(slam_pose2_t{}.getEncodedSize());
    for (std::size_t i = 0; i < made.counted; ++i) parts_->map.earn(bytes);
    for (const model::SlamPose& pose : made.poses) poses_.publish(pose);
  }

  void publish_delta(const model::MapUpdate& update, bool is_new_map) {
    const auto delta = parts_->map.on_update(
        update, stage_->take_changed_landmarks(),
        [this](std::span<model::MapLandmark> landmarks) { stage_->set_covariances(landmarks); });
    if (!delta) return;
    parts_->map.earn(deltas_.publish(*delta));
    if (is_new_map) publish_map();
  }

  model::WholeMap whole_map() const {
    model::WholeMap map = parts_->map.whole(stage_->landmarks(), stage_->trajectory());
    for (model::KeyframePose& one : map.keyframes)
      one.covariance += parts_->poses.given_covariance_at(one.map_T_vehicle, parts_->map.map_id());
    return map;
  }

  void publish_map() { parts_->map.sent(maps_.publish(whole_map())); }

  void on_request(const map_request_t& request) {
    model::WholeMap map = whole_map();
    if (request.everything == 0) cut_to(request, map);
    maps_.publish(map);
  }

  MapperChannels channels_;
  SmoothingMapperParameters parameters_;
  MapperInputParameters input_;
  MapperOutputParameters output_;
  HealthParameters health_;
  std::optional<smoothing::SmoothingMapper> stage_;
  bus::Node* node_ = nullptr;
  std::optional<Parts> parts_;
  bus::Publisher<model::SlamPose> poses_;
  bus::Publisher<model::MapUpdate> updates_;
  bus::Publisher<model::WholeMap> maps_;
  bus::Publisher<model::MapDelta> deltas_;
  bus::Publisher<model::Submap> submaps_;
  bus::Publisher<model::SubmapQuery> queries_;
  bus::Publisher<model::MapCorrection> corrections_;
  bus::Publisher<model::LoopResult> results_;
};

}  // namespace

bus::Service geoslam_mapper_service(const MapperChannels& channels) {
  return {"geoslam_mapper", channels.all,
          [channels] { return std::make_unique<MapperAdapter>(channels); }};
}

}  // namespace understory::geoslam_mapper
