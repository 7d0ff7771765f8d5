#include "services/geoslam_mapper/adapter.hpp"

#include <algorithm>
#include <memory>

#include "services/geoslam_mapper/adapter_parameters.hpp"
#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "services/geoslam_mapper/pose_publishing.hpp"
#include "understory/map_request_t.hpp"

namespace understory::geoslam_mapper {
namespace {

/// Removes what lies outside the bounds that the request gives.
void cut(model::WholeMap& map, const map_request_t& request) {
  const auto is_outside = [&](const Eigen::Vector2d& position) {
    return position.x() < request.min_m[0] || position.x() > request.max_m[0] ||
           position.y() < request.min_m[1] || position.y() > request.max_m[1];
  };
  std::erase_if(map.landmarks, [&](const auto& one) { return is_outside(one.position_m); });
  std::erase_if(map.keyframes,
                [&](const auto& one) { return is_outside(one.map_T_vehicle.translation()); });
  map.complete = false;
}

constexpr state::Format kFormat{"geoslam_mapper", 2};

/// What a holder of every MAP_DELTA has.
struct KnownMap {
  model::Utime utime = 0;
  std::uint64_t version = 0;
  std::vector<model::MapLandmark> landmarks;  // in order of id

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.version, s.landmarks);
  }
};

/// What the adapter itself remembers between messages.
struct Memory {
  KnownMap known;
  OdometryFrame odometry;
  JumpWatch jumps;
  bool map_is_published = true;
  model::Utime newest_pose_utime = -1;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.known, s.odometry, s.jumps, s.map_is_published, s.newest_pose_utime);
  }
};

class MapperAdapter : public bus::Adapter {
 public:
  explicit MapperAdapter(MapperChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    geoslam_mapper::describe(parameters_, table);
    geoslam_mapper::describe(output_, table);
  }

  void bind(bus::Node& node) override {
    stage_ = make_mapper(parameters_);
    memory_ = empty_memory();
    subscribe(node);
    advertise(node);
    node.every(static_cast<model::Utime>(output_.map_period_s * 1e6),
               [this](model::Utime /*now*/) { publish_changed_map(); });
  }

  void finish() override { publish_changed_map(); }

  std::string save() const override { return state::save(kFormat, memory_, stage_->save()); }

  void load(const std::string& state) override {
    Memory memory = empty_memory();
    std::string stage;
    state::load(state, kFormat, memory, stage);
    stage_->load(stage);
    memory_ = std::move(memory);
  }

 private:
  Memory empty_memory() const {
    Memory memory;
    memory.jumps = JumpWatch(output_.reset_distance_m, output_.reset_angle_rad);
    return memory;
  }

  void subscribe(bus::Node& node) {
    node.subscribe<model::Keyframe>(
        channels_.keyframe, [this](const model::Keyframe& one) { add(one); }, {.queue_size = 200});

    // Not in the journal: a scan changes nothing in the map, and the next one is located anew.
    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) { locate(scan); },
                                        {.journaled = false});

    // Small, and each one that is lost breaks the chain of motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) {
                                      stage_->add(motion);
                                      memory_.odometry.add(motion);
                                    },
                                    {.queue_size = 2000});

    // Bias and velocity, and the motion to gate by; no measurement: it was made from the same
    // detections.
    node.subscribe<model::EkfPose>(channels_.ekf_pose,
                                   [this](const model::EkfPose& pose) { stage_->add(pose); });
    node.subscribe<model::EkfLevel>(channels_.ekf_level,
                                    [this](const model::EkfLevel& level) { stage_->add(level); });
    node.subscribe<map_request_t>(channels_.map_request,
                                  [this](const map_request_t& request) { answer(request); },
                                  {.queue_size = 4, .sequenced = false, .journaled = false});
  }

  void advertise(bus::Node& node) {
    poses_ = node.advertise<model::SlamPose>(channels_.slam_pose);
    updates_ = node.advertise<model::MapUpdate>(channels_.slam_update);
    maps_ = node.advertise<model::WholeMap>(channels_.map);
    deltas_ = node.advertise<model::MapDelta>(channels_.map_delta);
  }

  void add(const model::Keyframe& keyframe) {
    const model::MapUpdate update = stage_->add(keyframe);
    updates_.publish(update);
    memory_.jumps.add(keyframe, update);
    publish_poses(keyframe, update);
    publish_delta(update);
  }

  /// The pose of a scan at once, in the map as it is; its keyframe comes later.
  void locate(const model::LandmarkScan& scan) {
    const std::optional<geometry::SE2WithCovariance> found = stage_->locate(scan);
    if (!found || scan.utime <= memory_.newest_pose_utime) return;
    model::SlamPose pose;
    pose.utime = scan.utime;
    pose.submap_T_vehicle = found->mean;
    pose.covariance = found->covariance;
    publish(pose);
  }

  void publish_poses(const model::Keyframe& keyframe, const model::MapUpdate& update) {
    for (model::SlamPose& pose : poses_of(keyframe, update)) {
      // Keyframes may share scans; the stamp always grows.
      if (pose.utime <= memory_.newest_pose_utime) continue;
      publish(pose);
    }
  }

  void publish(model::SlamPose& pose) {
    memory_.newest_pose_utime = pose.utime;
    pose.map_T_odom = pose.map_T_vehicle() * memory_.odometry.odom_T_vehicle(pose.utime).inverse();
    pose.reset_counter = memory_.jumps.count();
    pose.reset_delta = memory_.jumps.delta();
    poses_.publish(pose);
  }

  void publish_delta(const model::MapUpdate& update) {
    const auto changed = stage_->take_changed_landmarks();
    model::MapDelta delta =
        changed
            ? map_change(memory_.known.landmarks, *changed, update, output_.moved_m)
            : map_difference(memory_.known.landmarks, stage_->landmarks(), update, output_.moved_m);

    memory_.known.utime = std::max(memory_.known.utime, update.utime);
    const bool changes = !delta.added.empty() || !delta.moved.empty() || !delta.removed.empty() ||
                         !delta.merged.empty();
    if (!changes) return;

    delta.base_version = memory_.known.version;
    delta.version = ++memory_.known.version;
    memory_.known.landmarks = with_delta(std::move(memory_.known.landmarks), delta);
    memory_.map_is_published = false;
    deltas_.publish(delta);
  }

  model::WholeMap whole_map() const {
    model::WholeMap map;
    map.utime = memory_.known.utime;
    map.version = memory_.known.version;
    map.landmarks = stage_->landmarks();
    map.keyframes = stage_->trajectory();
    return map;
  }

  void publish_changed_map() {
    if (memory_.map_is_published) return;
    memory_.map_is_published = true;
    maps_.publish(whole_map());
  }

  void answer(const map_request_t& request) {
    model::WholeMap map = whole_map();
    if (request.everything == 0) cut(map, request);
    maps_.publish(map);
  }

  MapperChannels channels_;
  MapperParameters parameters_;
  MapperOutputParameters output_;
  std::unique_ptr<MapperMethod> stage_;
  Memory memory_;
  bus::Publisher<model::SlamPose> poses_;
  bus::Publisher<model::MapUpdate> updates_;
  bus::Publisher<model::WholeMap> maps_;
  bus::Publisher<model::MapDelta> deltas_;
};

}  // namespace

bus::Service geoslam_mapper_service(const MapperChannels& channels) {
  return {"geoslam_mapper",
          channels.keyframe + ", " + channels.landmarks + ", " + channels.odometry + ", " +
              channels.ekf_pose + ", " + channels.ekf_level + " -> " + channels.slam_pose + ", " +
              channels.slam_update + ", " + channels.map + ", " + channels.map_delta,
          [channels] { return std::make_unique<MapperAdapter>(channels); }};
}

}  // namespace understory::geoslam_mapper
