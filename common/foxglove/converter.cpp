#include "common/foxglove/converter.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <unordered_map>

#include "common/foxglove/frame_links.hpp"
#include "common/foxglove/landmark_scene.hpp"
#include "common/foxglove/messages.hpp"
#include "common/foxglove/numbers.hpp"
#include "common/foxglove/scene.hpp"
#include "common/foxglove/travelled_path.hpp"
#include "common/wire/checks.hpp"
#include "common/wire/convert.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::foxglove {
namespace {

/// At most `most` of them, evenly taken.
std::vector<geometry::SE2> thinned(const std::vector<model::KeyframePose>& keyframes,
                                   std::size_t most) {
  const std::size_t step = keyframes.size() / std::max<std::size_t>(1, most) + 1;
  std::vector<geometry::SE2> poses;
  for (std::size_t i = 0; i < keyframes.size(); i += step) {
    poses.push_back(keyframes[i].map_T_vehicle);
  }
  return poses;
}

std::string_view result_text(model::LoopResult::Status status) {
  constexpr std::array<std::string_view, 4> kTexts{"accepted", "waiting", "refused", "revoked"};
  return kTexts[std::min<std::size_t>(static_cast<std::size_t>(status), 3)];
}

}  // namespace

class Converter::Impl {
 public:
  explicit Impl(const Limits& limits)
      : limits_(limits), scene_(limits.landmarks), path_(limits.path_poses) {
    wanted_.fill(true);
  }

  std::vector<Converted> take(std::string_view channel, std::span<const std::uint8_t> bytes,
                              std::int64_t received_utime) {
    out_.clear();
    received_utime_ = received_utime;
    const auto handler = handlers().find(channel);
    if (handler != handlers().end()) (this->*handler->second)(bytes);
    std::ranges::stable_sort(out_, {}, &Converted::topic);
    return std::move(out_);
  }

  std::optional<Converted> state_of(TopicId id) const {
    if (id != TopicId::kLandmarks) return latest_[static_cast<std::size_t>(id)];
    if (scene_.size() == 0) return std::nullopt;
    return Converted{id, nanoseconds(received_utime_), nanoseconds(map_utime_),
                     std::make_shared<const std::string>(scene_.whole(map_utime_))};
  }

  void set_wanted(TopicId id, bool is_wanted) { wanted_[static_cast<std::size_t>(id)] = is_wanted; }
  std::uint64_t refused() const { return refused_; }
  const LandmarkScene& scene() const { return scene_; }

  using Handler = void (Impl::*)(std::span<const std::uint8_t>);
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
  void handle(std::span<const std::uint8_t> bytes) {
    const auto message = wire::decode_message<Message>(bytes);
    if (message) {
      on(*message);
    } else {
      ++refused_;
    }
  }

  void on(const model::SlamPose& pose);
  void on(const model::MapUpdate& update);
  void on(const model::WholeMap& map);
  void on(const model::MapDelta& delta);
  void on(const model::Submap& submap);
  void on(const model::MapCorrection& correction);
  void on(const model::Existence& existence);
  void on(const model::LandmarkScan& scan);
  void on(const lidar_scan_t& scan);
  void on(const model::PointSweep& part);
  void on(const model::EkfPose& pose);
  void on(const model::RawPose& pose);
  void on(const ground_truth_t& truth);
  void on(const truth_landmarks_t& truth);
  void on(const gnss_t& fix);
  void on(const log_t& line);
  void on(const health_t& health);
  void on(const model::LoopClosure& closure);
  void on(const model::LoopResult& result);
  void on(const model::ImuSample& sample);

  /// Makes the message only where somebody wants it.
  template <class MakeJson>
  void give(TopicId id, model::Utime utime, MakeJson make_json) {
    const auto place = static_cast<std::size_t>(id);
    const bool keeps = topic(id).has_state && id != TopicId::kLandmarks;
    if (!wanted_[place] && !keeps) return;
    out_.push_back({id, nanoseconds(received_utime_), nanoseconds(utime),
                    std::make_shared<const std::string>(make_json())});
    if (keeps) latest_[place] = out_.back();
  }
  void give_landmarks(model::Utime utime);
  void give_path(const model::SlamPose& pose);
  PoseNumbers numbers_of(const model::SlamPose& pose) const;

  Limits limits_;
  LandmarkScene scene_;
  TravelledPath path_;
  FrameLinks frames_;
  model::SweepAssembler sweeps_;
  std::array<std::optional<Converted>, kTopics> latest_;
  std::array<bool, kTopics> wanted_{};
  std::vector<Converted> out_;  ///< Of the message in hand.
  std::int64_t received_utime_ = 0;
  model::Utime map_utime_ = 0;   ///< Newest stamp of the landmarks.
  model::Utime path_utime_ = 0;  ///< Of the last path that was given.
  std::uint64_t refused_ = 0;
};

void Converter::Impl::on(const model::SlamPose& pose) {
  if (is_usable(pose)) {
    frames_.take(pose);
    give(TopicId::kTransforms, pose.utime,
         [&] { return frame_transforms(pose.utime, frames_.links()); });
    give(TopicId::kPose, pose.utime,
         [&] { return pose_in_frame(pose.utime, kMapFrame, pose.map_T_vehicle()); });
    give_path(pose);
  }
  give(TopicId::kPoseNumbers, pose.utime, [&] { return to_json(numbers_of(pose)); });
}

void Converter::Impl::on(const model::MapUpdate& update) {
  scene_.take(update);
  give(TopicId::kUpdateNumbers, update.utime, [&] { return to_json(update); });
}

void Converter::Impl::on(const model::WholeMap& map) {
  scene_.take(map);
  give_landmarks(map.utime);
  give(TopicId::kKeyframes, map.utime, [&] {
    return poses_in_frame(map.utime, kMapFrame, thinned(map.keyframes, limits_.path_poses));
  });
}

void Converter::Impl::on(const model::MapDelta& delta) {
  scene_.take(delta);
  give_landmarks(delta.utime);
}

void Converter::Impl::on(const model::Submap& submap) {
  scene_.take(submap);
  give_landmarks(submap.utime);
}

void Converter::Impl::on(const model::MapCorrection& correction) {
  give(TopicId::kSubmapTransforms, correction.utime, [&] { return frame_transforms(correction); });
}

void Converter::Impl::on(const model::Existence& existence) {
  scene_.take(existence);
  give_landmarks(existence.utime);
  give(TopicId::kExistenceNumbers, existence.utime, [&] { return to_json(existence); });
}

void Converter::Impl::on(const model::LandmarkScan& scan) {
  give(TopicId::kDetections, scan.utime, [&] { return detections_scene(scan); });
}

void Converter::Impl::on(const lidar_scan_t& scan) {
  wire::Checks checks;
  checks.pose("vehicle_T_sensor", scan.vehicle_T_sensor);
  if (checks.refusal() || !wire::from_wire(scan)) {
    ++refused_;
    return;
  }
  give(TopicId::kScan, scan.utime, [&] { return laser_scan(scan); });
}

void Converter::Impl::on(const model::PointSweep& part) {
  if (!wanted_[static_cast<std::size_t>(TopicId::kSweep)]) return;
  const auto sweep = sweeps_.add(part);
  if (!sweep) return;
  give(TopicId::kSweep, sweep->utime, [&] { return point_cloud(*sweep, limits_.sweep_points); });
}

void Converter::Impl::on(const model::EkfPose& pose) {
  frames_.take(pose);
  give(TopicId::kFilterPose, pose.utime,
       [&] { return pose_in_frame(pose.utime, "ekf_map", pose.ekf_map_T_vehicle); });
  give(TopicId::kFilterNumbers, pose.utime, [&] { return to_json(pose); });
}

void Converter::Impl::on(const model::RawPose& pose) {
  const TopicId id = pose.is_reference ? TopicId::kReference : TopicId::kDeadReckoning;
  const std::string_view frame = pose.is_reference ? "reference" : "odom";
  give(id, pose.utime, [&] { return pose_in_frame(pose.utime, frame, pose.odom_T_vehicle); });
}

void Converter::Impl::on(const ground_truth_t& truth) {
  wire::Checks checks;
  checks.pose("world_T_vehicle", truth.world_T_vehicle);
  if (checks.refusal()) {
    ++refused_;
    return;
  }
  const geometry::SE2 world_T_vehicle = wire::from_wire(truth.world_T_vehicle);
  frames_.take_truth(truth.utime, world_T_vehicle);
  give(TopicId::kTruth, truth.utime,
       [&] { return pose_in_frame(truth.utime, "world", world_T_vehicle); });
}

void Converter::Impl::on(const truth_landmarks_t& truth) {
  wire::Checks checks;
  for (const truth_landmark_t& one : truth.landmarks) {
    checks.pose("position_m", {one.position_m[0], one.position_m[1], 0.0});
    checks.range("radius_m", one.radius_m, 0.0, 1e3);
  }
  if (checks.refusal()) {
    ++refused_;
    return;
  }
  give(TopicId::kTruthLandmarks, truth.utime, [&] { return truth_scene(truth); });
}

void Converter::Impl::on(const gnss_t& fix) {
  if (!wire::from_wire(fix)) {
    // A receiver without a fix says so; that is no fault.
    if (fix.valid != 0) ++refused_;
    return;
  }
  if (fix.has_geodetic != 0) {
    give(TopicId::kFix, fix.utime, [&] { return location_fix(fix); });
  }
  give(TopicId::kLocalFix, fix.utime, [&] {
    return pose_in_frame(fix.utime, "gnss", geometry::SE2(fix.east_m, fix.north_m, 0.0));
  });
}

void Converter::Impl::on(const log_t& line) {
  give(TopicId::kLog, line.utime, [&] { return log_line(line); });
}

void Converter::Impl::on(const health_t& health) {
  give(TopicId::kHealthNumbers, health.utime, [&] { return to_json(health); });
}

void Converter::Impl::on(const model::LoopClosure& closure) {
  const LoopNumbers numbers{closure.utime, closure.id, closure.source,
                            closure.is_revoked ? "revoked" : "sent", ""};
  give(TopicId::kLoopNumbers, closure.utime, [&] { return to_json(numbers); });
}

void Converter::Impl::on(const model::LoopResult& result) {
  const LoopNumbers numbers{result.utime, result.closure_id, "",
                            std::string(result_text(result.status)), result.reason};
  give(TopicId::kLoopNumbers, result.utime, [&] { return to_json(numbers); });
}

void Converter::Impl::on(const model::ImuSample& sample) {
  give(TopicId::kImuNumbers, sample.utime, [&] { return to_json(sample); });
}

void Converter::Impl::give_landmarks(model::Utime utime) {
  map_utime_ = std::max(map_utime_, utime);
  if (!scene_.has_changed()) return;
  give(TopicId::kLandmarks, utime, [&] { return scene_.update(map_utime_); });
  scene_.skip_update();
}

void Converter::Impl::give_path(const model::SlamPose& pose) {
  if (!path_.add(pose)) return;
  const bool is_early = pose.utime >= path_utime_ && pose.utime - path_utime_ < limits_.path_us &&
                        path_.poses().size() > 1;
  if (is_early) return;
  path_utime_ = pose.utime;
  give(TopicId::kPath, pose.utime,
       [&] { return poses_in_frame(pose.utime, kMapFrame, path_.poses()); });
}

PoseNumbers Converter::Impl::numbers_of(const model::SlamPose& pose) const {
  PoseNumbers numbers{pose};
  numbers.latency_s = 1e-6 * static_cast<double>(received_utime_ - pose.utime);
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
void Converter::set_wanted(TopicId topic, bool is_wanted) { impl_->set_wanted(topic, is_wanted); }
std::uint64_t Converter::refused() const { return impl_->refused(); }
std::uint64_t Converter::landmarks_left_out() const { return impl_->scene().left_out(); }

}  // namespace understory::foxglove
