#include "common/foxglove/converter.hpp"

#include <algorithm>
#include <numbers>
#include <unordered_map>

#include "common/foxglove/frame_links.hpp"
#include "common/foxglove/landmark_scene.hpp"
#include "common/foxglove/messages.hpp"
#include "common/foxglove/numbers.hpp"
#include "common/foxglove/outbox.hpp"
#include "common/foxglove/scene.hpp"
#include "common/foxglove/single_messages.hpp"
#include "common/foxglove/travelled_path.hpp"
#include "common/wire/checks.hpp"
#include "common/wire/convert.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::foxglove {
namespace {

/// At most `most` poses, evenly selected.
std::vector<geometry::SE2> thinned(const std::vector<model::KeyframePose>& keyframes,
                                   std::size_t most) {
  const std::size_t step = keyframes.size() / std::max<std::size_t>(1, most) + 1;
  std::vector<geometry::SE2> poses;
  for (std::size_t i = 0; i < keyframes.size(); i += step) {
    poses.push_back(keyframes[i].map_T_vehicle);
  }
  return poses;
}

}  // namespace

class Converter::Impl {
 public:
  explicit Impl(const Limits& limits)
      : limits_(limits), scene_(limits.landmarks), path_(limits.path_poses) {}

  std::vector<Converted> take(std::string_view channel, std::span<const std::uint8_t> bytes,
                              std::int64_t received_utime) {
    out_.begin(received_utime);
    const auto handler = handlers().find(channel);
    if (handler != handlers().end() && !(this->*handler->second)(bytes)) ++refused_;
    return out_.take();
  }

  std::optional<Converted> state_of(TopicId id) const {
    if (id != TopicId::kLandmarks) return out_.latest(id);
    if (scene_.size() == 0) return std::nullopt;
    return out_.made(id, map_utime_, scene_.whole(map_utime_));
  }

  const LandmarkScene& scene() const { return scene_; }
  std::uint64_t refused() const { return refused_; }

  /// Takes bytes; false = refused.
  using Handler = bool (Impl::*)(std::span<const std::uint8_t>);
  static const std::unordered_map<std::string_view, Handler>& handlers() {
    static const std::unordered_map<std::string_view, Handler> all{
        {"SLAM_POSE", &Impl::handle<model::SlamPose>},
        {"SLAM_UPDATE", &Impl::handle<model::MapUpdate>},
        {"MAP", &Impl::handle<model::WholeMap>},
        {"MAP_DELTA", &Impl::handle<model::MapDelta>},
        {"SUBMAP", &Impl::handle<model::Submap>},
        {"MAP_CORRECTION", &Impl::handle<model::MapCorrection>},
        {"EXISTENCE", &Impl::handle<model::Existence>},
        {"LANDMARKS", &Impl::handle<model::LandmarkScan>},
        {"LIDAR_SCAN", &Impl::handle<lidar_scan_t>},
        {"LIDAR_SWEEP", &Impl::handle<model::PointSweep>},
        {"EKF_POSE", &Impl::handle<model::EkfPose>},
        {"RAW_POSE", &Impl::handle<model::RawPose>},
        {"GROUND_TRUTH", &Impl::handle<ground_truth_t>},
        {"TRUTH_LANDMARKS", &Impl::handle<truth_landmarks_t>},
        {"GNSS", &Impl::handle<gnss_t>},
        {"LOG", &Impl::handle<log_t>},
        {"HEALTH", &Impl::handle<health_t>},
        {"LOOP_CLOSURE", &Impl::handle<model::LoopClosure>},
        {"LOOP_RESULT", &Impl::handle<model::LoopResult>},
        {"IMU", &Impl::handle<model::ImuSample>}};
    return all;
  }

 private:
  template <class Message>
  bool handle(std::span<const std::uint8_t> bytes) {
    const auto message = wire::decode_message<Message>(bytes);
    return message && on(*message);
  }
  template <class Message>
  bool on(const Message& message) {
    return give_message(out_, message);
  }
  bool on(const model::SlamPose& pose);
  bool on(const model::MapUpdate& update);
  bool on(const model::WholeMap& map);
  bool on(const model::MapDelta& delta) { return change_scene(delta); }
  bool on(const model::Submap& submap) { return change_scene(submap); }
  bool on(const model::Existence& existence);
  bool on(const model::PointSweep& part);
  bool on(const model::EkfPose& pose);
  bool on(const ground_truth_t& truth);
  template <class Message>
  bool change_scene(const Message& message);
  void give_path(const model::SlamPose& pose);
  PoseNumbers numbers_of(const model::SlamPose& pose) const;

  Limits limits_;
  Outbox out_;
  LandmarkScene scene_;
  TravelledPath path_;
  FrameLinks frames_;
  model::SweepAssembler sweeps_;
  model::Utime map_utime_ = 0;   ///< Newest stamp of the landmarks.
  model::Utime path_utime_ = 0;  ///< Stamp of the last path.
  std::uint64_t refused_ = 0;
};

bool Converter::Impl::on(const model::SlamPose& pose) {
  if (is_usable(pose)) {
    frames_.take(pose);
    out_.give(TopicId::kTransforms, pose.utime, frame_transforms(pose.utime, frames_.links()));
    out_.give(TopicId::kPose, pose.utime,
              pose_in_frame(pose.utime, kMapFrame, pose.map_T_vehicle()));
    give_path(pose);
  }
  out_.give(TopicId::kPoseNumbers, pose.utime, to_json(numbers_of(pose)));
  return true;
}

bool Converter::Impl::on(const model::MapUpdate& update) {
  scene_.take(update);
  out_.give(TopicId::kUpdateNumbers, update.utime, to_json(update));
  return true;
}

bool Converter::Impl::on(const model::WholeMap& map) {
  change_scene(map);
  out_.give(TopicId::kKeyframes, map.utime,
            poses_in_frame(map.utime, kMapFrame, thinned(map.keyframes, limits_.path_poses)));
  return true;
}

bool Converter::Impl::on(const model::Existence& existence) {
  change_scene(existence);
  out_.give(TopicId::kExistenceNumbers, existence.utime, to_json(existence));
  return true;
}

bool Converter::Impl::on(const model::PointSweep& part) {
  const auto sweep = sweeps_.add(part);
  if (!sweep) return true;
  out_.give(TopicId::kSweep, sweep->utime, point_cloud(*sweep, limits_.sweep_points));
  return true;
}

bool Converter::Impl::on(const model::EkfPose& pose) {
  frames_.take(pose);
  out_.give(TopicId::kFilterPose, pose.utime,
            pose_in_frame(pose.utime, "ekf_map", pose.ekf_map_T_vehicle));
  out_.give(TopicId::kFilterNumbers, pose.utime, to_json(pose));
  return true;
}

bool Converter::Impl::on(const ground_truth_t& truth) {
  wire::Checks checks;
  checks.pose("world_T_vehicle", truth.world_T_vehicle);
  if (checks.refusal()) return false;
  const geometry::SE2 world_T_vehicle = wire::from_wire(truth.world_T_vehicle);
  frames_.take_truth(truth.utime, world_T_vehicle);
  out_.give(TopicId::kTruth, truth.utime, pose_in_frame(truth.utime, "world", world_T_vehicle));
  return true;
}

template <class Message>
bool Converter::Impl::change_scene(const Message& message) {
  scene_.take(message);
  map_utime_ = std::max(map_utime_, message.utime);
  if (!scene_.has_changed()) return true;
  out_.give(TopicId::kLandmarks, message.utime, scene_.update(map_utime_));
  scene_.skip_update();
  return true;
}

void Converter::Impl::give_path(const model::SlamPose& pose) {
  if (!path_.add(pose)) return;
  const model::Utime since = pose.utime - path_utime_;
  const bool is_early = since >= 0 && since < limits_.path_us && path_.poses().size() > 1;
  if (is_early) return;
  path_utime_ = pose.utime;
  out_.give(TopicId::kPath, pose.utime, poses_in_frame(pose.utime, kMapFrame, path_.poses()));
}

PoseNumbers Converter::Impl::numbers_of(const model::SlamPose& pose) const {
  PoseNumbers numbers{pose};
  numbers.latency_s = 1e-6 * static_cast<double>(out_.received_utime() - pose.utime);
  const auto truth = is_usable(pose) ? frames_.true_pose() : std::nullopt;
  if (truth) {
    const geometry::SE2 error = truth->inverse() * pose.map_T_vehicle();
    numbers.error_m = error.translation().norm();
    numbers.error_deg = error.theta() * 180.0 / std::numbers::pi;
  }
  return numbers;
}

Converter::Converter(const Limits& limits) : impl_(std::make_unique<Impl>(limits)) {}
Converter::~Converter() = default;

std::vector<Converted> Converter::take(std::string_view channel,
                                       std::span<const std::uint8_t> bytes,
                                       std::int64_t received_utime) {
  return impl_->take(channel, bytes, received_utime);
}
std::optional<Converted> Converter::state_of(TopicId topic) const { return impl_->state_of(topic); }
bool Converter::takes(std::string_view channel) { return Impl::handlers().contains(channel); }
std::uint64_t Converter::refused() const { return impl_->refused(); }
std::uint64_t Converter::landmarks_left_out() const { return impl_->scene().left_out(); }

}  // namespace understory::foxglove
