#include "services/geoslam_mapper/adapter.hpp"

#include <algorithm>
#include <memory>

#include "common/model/held_map.hpp"
#include "services/geoslam_mapper/adapter_parameters.hpp"
#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/geoslam_mapper/given_map.hpp"
#include "services/geoslam_mapper/hand_over.hpp"
#include "services/geoslam_mapper/health_watch.hpp"
#include "services/geoslam_mapper/lines_of_sight.hpp"
#include "services/geoslam_mapper/map_budget.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "services/geoslam_mapper/pose_publishing.hpp"
#include "understory/map_request_t.hpp"

namespace understory::geoslam_mapper {
namespace {

/// Members for which a KEYFRAME has room beside its landmarks; usual are 8.
constexpr std::size_t kMembers = 64;
/// Members that may have a detection of each of its landmarks.
constexpr std::size_t kUsualMembers = 16;

/// Bytes of a MAP with so many parts.
std::size_t map_bytes(std::size_t landmarks, std::size_t keyframes) {
  return wire::bytes_with<map_t, map_landmark_t>(landmarks) +
         keyframes * wire::element_bytes<keyframe_pose_t>();
}

/// Bytes of a SUBMAP with so many landmarks: its keyframes and its payload take as much again.
std::size_t submap_bytes(std::size_t landmarks) {
  return 8 * wire::bytes_with<submap_t, map_landmark_t>(landmarks);
}
/// Most landmarks of one stretch of the path.
constexpr std::size_t kSubmapLandmarks = 2000;

constexpr state::Format kFormat{"geoslam_mapper", 9};

/// What a holder of every MAP_DELTA has.
struct KnownMap {
  model::Utime utime = 0;
  std::uint64_t version = 0;
  std::uint32_t map_id = 0;                   // 0 before the first keyframe
  std::vector<model::MapLandmark> landmarks;  // in order of id

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.version, s.map_id, s.landmarks);
  }
};

/// What the adapter itself remembers between messages.
struct Memory {
  KnownMap known;
  OdometryFrame odometry;
  JumpWatch jumps;
  HealthWatch health;
  MapBudget budget;
  HandOver hand_over;
  CorrectionWatch corrections;
  LinesOfSight sights;
  GivenFrame given_frame;
  bool map_is_published = true;
  bool map_is_due = false;      ///< It started or jumped since it was last published.
  bool is_provisional = false;  ///< The map, by its last keyframe.
  std::uint64_t keyframes = 0;
  model::Utime newest_pose_utime = -1;
  model::Utime earned_pose_utime = -1;  ///< Poses up to it are in the budget.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.known, s.odometry, s.jumps, s.health, s.budget, s.hand_over, s.corrections, s.sights,
      s.given_frame, s.map_is_published, s.map_is_due, s.is_provisional, s.keyframes,
      s.newest_pose_utime, s.earned_pose_utime);
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
    stage_ = make_mapper(parameters_);
    memory_ = empty_memory();
    if (!input_.map_file.empty()) begin_with(read_given_map(input_.map_file, input_.map_id));
    subscribe(node);
    advertise(node);
    node.every(static_cast<model::Utime>(output_.map_period_s * 1e6),
               [this](model::Utime /*now*/) { publish_map_within_budget(); });
  }

  void finish() override {
    if (!memory_.map_is_published) publish_map();
    publish_correction(true);
  }

  std::string save() const override { return state::save(kFormat, memory_, stage_->save()); }

  void load(const std::string& state) override {
    Memory memory = empty_memory();
    std::string stage;
    state::load(state, kFormat, memory, stage);
    stage_->load(stage);
    memory_ = std::move(memory);
    memory_.given_frame.rebuild();
    show_health();
  }

  void state_was_lost(std::int64_t written_s) override {
    const NumbersAfterLoss first = numbers_after_loss(written_s);
    memory_.jumps.begin_behind(first.resets);
    // A given map has its number.
    if (memory_.known.map_id == 0) stage_->begin_with_number(first.map_id);
  }

 private:
  Memory empty_memory() const {
    Memory memory;
    memory.jumps = JumpWatch(output_.reset_distance_m, output_.reset_angle_rad);
    memory.health = HealthWatch(health_);
    memory.budget = MapBudget(output_.map_share);
    return memory;
  }

  void subscribe(bus::Node& node) {
    const auto most_landmarks = static_cast<std::size_t>(input_.max_keyframe_landmarks);
    const auto most_detections = static_cast<std::size_t>(input_.max_detections);
    node.subscribe<model::Keyframe>(
        channels_.keyframe, [this](const model::Keyframe& one) { add(one); },
        {.queue_size = 200,
         .most_bytes =
             wire::bytes_with<keyframe2_t, keyframe_landmark_t>(most_landmarks) +
             kMembers * wire::element_bytes<keyframe_member_t>() +
             kUsualMembers * most_landmarks * wire::element_bytes<keyframe_detection_t>()});

    // Not in the journal: a scan changes nothing in the map, and the next one is located anew.
    node.subscribe<model::LandmarkScan>(
        channels_.landmarks, [this](const model::LandmarkScan& scan) { locate(scan); },
        {.most_bytes = wire::bytes_with<landmarks_t, detection_t>(most_detections),
         .journaled = false});

    // SLAM_UPDATE depends on them: journaled.
    node.subscribe<model::ViewRanges>(
        channels_.view_ranges,
        [this](const model::ViewRanges& ranges) { memory_.sights.add(ranges); },
        {.queue_size = 100});

    // Small, and each one that is lost breaks the chain of motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) {
                                      stage_->add(motion);
                                      memory_.odometry.add(motion);
                                    },
                                    {.queue_size = 2000});

    node.subscribe<model::RestLevel>(channels_.rest_level,
                                     [this](const model::RestLevel& level) { stage_->add(level); });

    // To gate by; no measurement: it was made from the same detections.
    node.subscribe<model::EkfPose>(channels_.ekf_pose, [this](const model::EkfPose& pose) {
      stage_->add(pose);
      memory_.health.add(pose);
    });
    node.subscribe<model::EkfLevel>(channels_.ekf_level,
                                    [this](const model::EkfLevel& level) { stage_->add(level); });
    node.subscribe<map_request_t>(channels_.map_request,
                                  [this](const map_request_t& request) { answer(request); },
                                  {.queue_size = 4, .sequenced = false, .journaled = false});

    // From another time, and not of a sequence.
    const auto most_given = static_cast<std::size_t>(input_.max_given_landmarks);
    node.subscribe<model::WholeMap>(channels_.given_map,
                                    [this](const model::WholeMap& map) { take_given(map); },
                                    {.queue_size = 2,
                                     .sequenced = false,
                                     .timed = false,
                                     .most_bytes = map_bytes(most_given, most_given)});
    subscribe_to_store(node);
  }

  void subscribe_to_store(bus::Node& node) {
    node.subscribe<model::SubmapStored>(channels_.submap_stored,
                                        [this](const model::SubmapStored& stored) {
                                          memory_.hand_over.confirm(stored);
                                          stage_->may_hand_over(memory_.hand_over.may_hand_over());
                                        },
                                        {.queue_size = 200});
    node.subscribe<model::Submap>(channels_.submap_reply,
                                  [this](const model::Submap& submap) { bring_back(submap); },
                                  {.queue_size = 50, .most_bytes = submap_bytes(kSubmapLandmarks)});

    // From whoever finds one or sets one; each numbers its own. Part of the map: journaled.
    node.subscribe<model::LoopClosure>(channels_.loop_closure,
                                       [this](const model::LoopClosure& closure) { take(closure); },
                                       {.queue_size = 200, .sequenced = false, .timed = false});
    node.subscribe<model::Existence>(channels_.existence,
                                     [this](const model::Existence& one) { stage_->take(one); },
                                     {.queue_size = 200});
  }

  void take(const model::LoopClosure& closure) {
    const model::LoopResult result = stage_->take(closure);
    memory_.health.add(result);
    results_.publish(result);
  }

  /// An answer may come twice: then the submap is not away any more.
  void bring_back(const model::Submap& submap) {
    const std::vector<model::SubmapId> wanted = stage_->wanted();
    if (std::ranges::find(wanted, submap.id) == wanted.end()) return;
    const std::string refused = stage_->bring_back(submap);
    if (!refused.empty())
      node_->report(wire::Reason::kInputRefused, refused, channels_.submap_reply);
    if (refused.empty()) memory_.keyframes += submap.keyframes.size();
  }

  /// What the mapper gave away goes to the store until that has it; what it wants back it asks for.
  void exchange_submaps(model::Utime now) {
    for (model::Submap& submap : stage_->take_given_away()) {
      forget(submap);
      memory_.hand_over.add(std::move(submap));
    }
    for (const model::Submap& submap : memory_.hand_over.due(now))
      memory_.budget.earn(submaps_.publish(submap));

    std::vector<model::SubmapId> away;
    for (const model::SubmapId id : stage_->wanted()) {
      if (const auto submap = memory_.hand_over.take(memory_.known.map_id, id)) {
        bring_back(*submap);
      } else {
        away.push_back(id);
      }
    }
    model::SubmapQuery query{now, 0, memory_.known.map_id, memory_.hand_over.to_ask(away, now)};
    if (!query.ids.empty()) queries_.publish(query);
    stage_->may_hand_over(memory_.hand_over.may_hand_over());
    memory_.health.keeps_up(memory_.hand_over.may_hand_over());
  }

  /// It changes no more: nobody is to be told that it went.
  void forget(const model::Submap& submap) {
    if (submap.map_id != memory_.known.map_id) return;
    const auto is_in = [&](const model::MapLandmark& known) {
      return std::ranges::binary_search(submap.landmarks, known.id, {}, &model::MapLandmark::id);
    };
    std::erase_if(memory_.known.landmarks, is_in);
    memory_.keyframes -= std::min<std::uint64_t>(memory_.keyframes, submap.keyframes.size());
  }

  void publish_correction(bool is_last) {
    if (auto correction = memory_.corrections.next(memory_.known.utime, memory_.known.map_id,
                                                   stage_->submap_poses(), is_last)) {
      memory_.budget.earn(corrections_.publish(*correction));
    }
  }

  /// Only in the beginning: a map that exists is not replaced.
  void take_given(const model::WholeMap& map) {
    std::string reason = why_not_given(map);
    if (memory_.known.map_id != 0) reason = "a map is there already";
    if (reason.empty()) return begin_with(map);
    node_->report(wire::Reason::kInputRefused, "a given map was not taken: " + reason,
                  channels_.given_map);
  }

  void begin_with(const model::WholeMap& map) {
    const std::vector<model::MapLandmark> landmarks =
        apart_from_keyframes(map, parameters_.smoothing.given_map_sigma_m);
    stage_->start_with(landmarks);
    memory_.given_frame = GivenFrame(map);
    (void)stage_->take_changed_landmarks();
    memory_.known.map_id = model::map_of(landmarks.back().id);
    memory_.known.landmarks = stage_->landmarks();
    ++memory_.known.version;
    memory_.map_is_published = false;
    memory_.map_is_due = true;
    memory_.health.must_find_map();
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

  void add(const model::Keyframe& keyframe) {
    model::MapUpdate update = stage_->add(keyframe);
    update.covariance += given_covariance_at(update.map_T_vehicle, update.map_id);
    identify_detections(keyframe, update);
    memory_.sights.fill(keyframe, memory_.known.landmarks, update);
    memory_.is_provisional = update.is_provisional;
    memory_.budget.earn(updates_.publish(update));
    memory_.jumps.add(keyframe, update);
    publish_poses(keyframe, update);
    publish_delta(update);
    exchange_submaps(keyframe.utime);
    if (memory_.corrections.is_due(keyframe.utime)) publish_correction(false);
    memory_.health.add(update);
    show_health();
  }

  void show_health() {
    for (const bus::WatchedCondition& one : memory_.health.conditions()) node_->show(one);
  }

  /// The pose of a scan at once, in the map as it is; its keyframe comes later.
  void locate(const model::LandmarkScan& scan) {
    newest_scan_utime_ = std::max(newest_scan_utime_, scan.utime);
    const std::optional<ScanPose> found = stage_->locate(scan);
    memory_.health.add_scan(found && found->is_coasting);
    show_health();
    if (!found || scan.utime <= memory_.newest_pose_utime) return;
    model::SlamPose pose;
    pose.utime = scan.utime;
    pose.is_coasting = found->is_coasting;
    pose.map_id = std::max(memory_.known.map_id, 1U);
    pose.is_provisional = memory_.is_provisional;
    pose.submap_T_vehicle = found->map_T_vehicle.mean;
    pose.covariance = found->map_T_vehicle.covariance +
                      given_covariance_at(found->map_T_vehicle.mean, pose.map_id);
    publish(pose);
  }

  /// What is not known of the given map's frame there; nothing where the vehicle left that map.
  Eigen::Matrix3d given_covariance_at(const geometry::SE2& map_T_vehicle,
                                      std::uint32_t map_id) const {
    return map_id == memory_.given_frame.map_id() ? memory_.given_frame.covariance_at(map_T_vehicle)
                                                  : Eigen::Matrix3d::Zero();
  }

  /// Whether this keyframe began another map than the last one's.
  bool is_another_map(const model::MapUpdate& update) const {
    return memory_.known.map_id != 0 && memory_.known.map_id != update.map_id;
  }

  void publish_poses(const model::Keyframe& keyframe, const model::MapUpdate& update) {
    for (model::SlamPose& pose : poses_of(keyframe, update)) {
      earn(pose);
      pose.is_new_map = is_another_map(update);
      // Keyframes may share scans; the stamp always grows.
      if (pose.utime <= memory_.newest_pose_utime || is_stale(pose)) continue;
      publish(pose);
    }
  }

  /// Where scans are located as they come, those of a keyframe that began a map, or found a lost
  /// vehicle, are the past.
  bool is_stale(const model::SlamPose& pose) const {
    const auto oldest = static_cast<model::Utime>(1e6 * output_.oldest_pose_s);
    return stage_->locates_scans() && newest_scan_utime_ - pose.utime > oldest;
  }

  /// Each scan's pose counts once and with its keyframe, whether it was published then or before:
  /// scans are not in the journal, and the budget shall be the same after a restart.
  void earn(const model::SlamPose& pose) {
    if (pose.utime <= memory_.earned_pose_utime) return;
    memory_.earned_pose_utime = pose.utime;
    memory_.budget.earn(static_cast<std::size_t>(slam_pose2_t{}.getEncodedSize()));
  }

  void publish(model::SlamPose& pose) {
    memory_.newest_pose_utime = pose.utime;
    pose.map_T_odom = pose.map_T_vehicle() * memory_.odometry.odom_T_vehicle(pose.utime).inverse();
    pose.reset_counter = memory_.jumps.count();
    pose.reset_delta = memory_.jumps.delta();
    poses_.publish(pose);
  }

  void publish_delta(const model::MapUpdate& update) {
    const bool is_another = is_another_map(update);
    memory_.known.map_id = update.map_id;
    if (is_another) memory_.known.landmarks.clear();
    const MapTolerance tolerance{output_.moved_m, update.map_T_vehicle.translation()};
    const auto changed = stage_->take_changed_landmarks();
    model::MapDelta delta =
        changed ? map_change(memory_.known.landmarks, *changed, update, tolerance)
                : map_difference(memory_.known.landmarks, stage_->landmarks(), update, tolerance);

    memory_.known.utime = std::max(memory_.known.utime, update.utime);
    if (is_another) memory_.keyframes = 0;
    if (update.status == model::MapUpdateStatus::kFirstMap ||
        update.status == model::MapUpdateStatus::kUpdated) {
      ++memory_.keyframes;
      memory_.map_is_published = false;  // Landmarks moved, if by less than the tolerance.
    }
    const bool changes = !delta.added.empty() || !delta.moved.empty() || !delta.removed.empty() ||
                         !delta.merged.empty();
    if (!changes) return;
    stage_->set_covariances(delta.added);
    stage_->set_covariances(delta.moved);

    // Another map builds on nothing; versions are never used again.
    delta.base_version = is_another ? 0 : memory_.known.version;
    delta.version = ++memory_.known.version;
    memory_.map_is_due |= delta.base_version == 0 ||
                          displaces_most(memory_.known.landmarks, delta, output_.reset_distance_m);
    memory_.known.landmarks = with_delta(std::move(memory_.known.landmarks), delta);
    memory_.map_is_published = false;
    memory_.budget.earn(deltas_.publish(delta));
    if (is_another) publish_map();
  }

  model::WholeMap whole_map() const {
    model::WholeMap map;
    map.utime = memory_.known.utime;
    map.version = memory_.known.version;
    map.landmarks = stage_->landmarks();
    map.keyframes = stage_->trajectory();
    for (model::KeyframePose& one : map.keyframes)
      one.covariance += given_covariance_at(one.map_T_vehicle, memory_.known.map_id);
    return map;
  }

  void publish_map_within_budget() {
    if (memory_.map_is_published) return;
    const bool is_due = memory_.map_is_due && memory_.budget.may_borrow();
    const std::size_t bytes = map_bytes(memory_.known.landmarks.size(), memory_.keyframes);
    if (is_due || memory_.budget.affords(bytes)) publish_map();
  }

  void publish_map() {
    memory_.budget.spend(maps_.publish(whole_map()));
    memory_.map_is_published = true;
    memory_.map_is_due = false;
  }

  void answer(const map_request_t& request) {
    model::WholeMap map = whole_map();
    if (request.everything == 0) cut_to(request, map);
    maps_.publish(map);
  }

  MapperChannels channels_;
  MapperParameters parameters_;
  MapperInputParameters input_;
  MapperOutputParameters output_;
  HealthParameters health_;
  std::unique_ptr<MapperMethod> stage_;
  bus::Node* node_ = nullptr;
  Memory memory_;
  model::Utime newest_scan_utime_ = -1;  ///< Not saved: scans are not in the journal.
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
