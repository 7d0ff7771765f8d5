#include "services/geoslam_mapper/adapter.hpp"

#include <algorithm>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "services/geoslam_mapper/adapter_parameters.hpp"
#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/geoslam_mapper/map_publishing.hpp"
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

/// Blocks of text with their lengths before them.
void write_block(std::ostream& out, const std::string& block) {
  out << block.size() << '\n' << block << '\n';
}
std::string read_block(std::istream& in, std::size_t limit) {
  std::size_t size = 0;
  if (!(in >> size) || in.get() != '\n' || size > limit) {
    throw std::runtime_error("the mapper's saved state is not whole");
  }
  std::string block(size, '\0');
  in.read(block.data(), static_cast<std::streamsize>(size));
  if (!in || in.get() != '\n') throw std::runtime_error("the mapper's saved state is not whole");
  return block;
}

class MapperAdapter : public bus::Adapter {
 public:
  explicit MapperAdapter(MapperChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    geoslam_mapper::describe(parameters_, table);
    geoslam_mapper::describe(output_, table);
  }

  void bind(bus::Node& node) override {
    stage_ = make_mapper(parameters_);
    jumps_ = JumpWatch(output_.reset_distance_m, output_.reset_angle_rad);
    node.subscribe<model::Keyframe>(
        channels_.keyframe, [this](const model::Keyframe& one) { add(one); }, {.queue_size = 200});
    // Not in the journal: a scan leaves nothing in the map, and the next one finds its place again.
    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) { locate(scan); },
                                        {.journaled = false});
    // Small, and each one that is shed breaks the chain of motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) {
                                      stage_->add(motion);
                                      odometry_.add(motion);
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
    poses_ = node.advertise<model::SlamPose>(channels_.slam_pose);
    updates_ = node.advertise<model::MapUpdate>(channels_.slam_update);
    maps_ = node.advertise<model::WholeMap>(channels_.map);
    deltas_ = node.advertise<model::MapDelta>(channels_.map_delta);
    node.every(static_cast<model::Utime>(output_.map_period_s * 1e6),
               [this](model::Utime /*now*/) { publish_changed_map(); });
  }

  void finish() override { publish_changed_map(); }

  std::string save() const override {
    std::ostringstream out;
    out << "mapper 1 " << map_is_published_ << ' ' << newest_pose_utime_ << '\n';
    const wire::Bytes known = wire::encode_message(known_);
    write_block(out, std::string(known.begin(), known.end()));
    write_block(out, odometry_.save());
    write_block(out, jumps_.save());
    write_block(out, stage_->save());
    return out.str();
  }

  void load(const std::string& state) override {
    std::istringstream in(state);
    std::string word;
    int version = 0;
    in >> word >> version >> map_is_published_ >> newest_pose_utime_;
    if (!in || word != "mapper" || version != 1 || in.get() != '\n') {
      throw std::runtime_error("the mapper's saved state is of another version");
    }
    const std::string known = read_block(in, state.size());
    const wire::Bytes bytes(known.begin(), known.end());
    auto map = wire::decode_message<model::WholeMap>(bytes);
    if (!map) throw std::runtime_error("the mapper's saved map: " + map.refusal().detail);
    known_ = std::move(*map);
    odometry_.load(read_block(in, state.size()));
    jumps_.load(read_block(in, state.size()));
    stage_->load(read_block(in, state.size()));
  }

 private:
  void add(const model::Keyframe& keyframe) {
    const model::MapUpdate update = stage_->add(keyframe);
    updates_.publish(update);
    jumps_.add(keyframe, update);
    publish_poses(keyframe, update);
    publish_delta(update);
  }

  /// The pose of a scan at once, in the map as it is; its keyframe comes later.
  void locate(const model::LandmarkScan& scan) {
    const std::optional<geometry::SE2WithCovariance> found = stage_->locate(scan);
    if (!found || scan.utime <= newest_pose_utime_) return;
    model::SlamPose pose;
    pose.utime = scan.utime;
    pose.submap_T_vehicle = found->mean;
    pose.covariance = found->covariance;
    publish(pose);
  }

  void publish_poses(const model::Keyframe& keyframe, const model::MapUpdate& update) {
    for (model::SlamPose& pose : poses_of(keyframe, update)) {
      // Keyframes may share scans; the stamp always grows.
      if (pose.utime <= newest_pose_utime_) continue;
      publish(pose);
    }
  }

  void publish(model::SlamPose& pose) {
    newest_pose_utime_ = pose.utime;
    pose.map_T_odom = pose.map_T_vehicle() * odometry_.odom_T_vehicle(pose.utime).inverse();
    pose.reset_counter = jumps_.count();
    pose.reset_delta = jumps_.delta();
    poses_.publish(pose);
  }

  void publish_delta(const model::MapUpdate& update) {
    const auto changed = stage_->take_changed_landmarks();
    model::MapDelta delta =
        changed ? map_change(known_.landmarks, *changed, update, output_.moved_m)
                : map_difference(known_.landmarks, stage_->landmarks(), update, output_.moved_m);
    known_.utime = std::max(known_.utime, update.utime);
    const bool changes = !delta.added.empty() || !delta.moved.empty() || !delta.removed.empty() ||
                         !delta.merged.empty();
    if (!changes) return;
    delta.base_version = known_.version;
    delta.version = ++known_.version;
    known_.landmarks = with_delta(std::move(known_.landmarks), delta);
    map_is_published_ = false;
    deltas_.publish(delta);
  }

  model::WholeMap whole_map() const {
    model::WholeMap map;
    map.utime = known_.utime;
    map.version = known_.version;
    map.landmarks = stage_->landmarks();
    map.keyframes = stage_->trajectory();
    return map;
  }

  void publish_changed_map() {
    if (map_is_published_) return;
    map_is_published_ = true;
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
  OdometryFrame odometry_;
  JumpWatch jumps_;
  model::WholeMap known_;  // what a holder of every MAP_DELTA knows; without keyframes
  bool map_is_published_ = true;
  model::Utime newest_pose_utime_ = -1;
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
