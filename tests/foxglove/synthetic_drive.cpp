#include "tests/foxglove/synthetic_drive.hpp"

#include <cmath>
#include <map>
#include <random>

#include "common/wire/convert.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::test {
namespace {

constexpr std::int64_t kStart_us = 1'700'000'000'000'000;
constexpr std::size_t kLandmarks = 60;

class Drive {
 public:
  std::vector<io::LogEvent> run(int scans) {
    plant();
    send("TRUTH_LANDMARKS", truth_landmarks());
    for (int k = 0; k < scans; ++k) scan(k);
    send("MAP", whole_map());
    return std::move(events_);
  }

 private:
  template <class Message>
  void send(const std::string& channel, const Message& message) {
    events_.push_back({static_cast<std::int64_t>(events_.size()), utime_ + 20'000, channel,
                       wire::encode_message(message)});
  }
  double real(double scale) {
    return std::uniform_real_distribution<double>(-scale, scale)(random_);
  }

  void plant() {
    for (std::size_t i = 0; i < kLandmarks; ++i) {
      model::MapLandmark landmark;
      landmark.id = (model::LandmarkId{1} << model::kLandmarkCounterBits) + i + 1;
      landmark.position_m = {real(40.0), real(40.0)};
      landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
      landmark.radius_m = i % 5 == 0 ? 0.0 : 0.2;
      landmark.observation_count = 3;
      landmark.kind = i % 7 == 0 ? model::LandmarkKind::kCorner : model::LandmarkKind::kTrunk;
      landmarks_.push_back(landmark);
    }
  }

  truth_landmarks_t truth_landmarks() const {
    truth_landmarks_t truth{};
    truth.utime = kStart_us;
    for (const model::MapLandmark& landmark : landmarks_) {
      truth.landmarks.push_back({static_cast<std::int64_t>(landmark.id),
                                 {landmark.position_m.x(), landmark.position_m.y()},
                                 landmark.radius_m,
                                 static_cast<std::int8_t>(landmark.kind)});
    }
    truth.num_landmarks = static_cast<std::int32_t>(truth.landmarks.size());
    return truth;
  }

  geometry::SE2 true_pose(int k) const {
    return geometry::SE2(20.0, 0.0, 0.0).inverse() * geometry::SE2::Exp({0.5 * k, 0.0, 0.025 * k});
  }

  void scan(int k) {
    utime_ = kStart_us + 100'000 * k;
    sequence_ = static_cast<std::uint64_t>(k);
    sensors(k);
    poses(k);
    if (k % 5 == 0) keyframe(k);
    if (k % 10 == 0) processes(k);
  }

  void sensors(int k) {
    ground_truth_t truth{};
    truth.utime = utime_;
    truth.seq = k;
    truth.world_T_vehicle = wire::to_wire(true_pose(k));
    send("GROUND_TRUTH", truth);
    send("IMU", model::ImuSample{utime_, sequence_, {0.0, 0.0, 0.25}, {0.1, real(0.2), 9.81}});

    lidar_scan_t scan{};
    scan.utime = utime_;
    scan.seq = k;
    scan.start_angle_rad = -1.5;
    scan.angle_step_rad = 0.01;
    scan.max_range_m = 80.0;
    for (int i = 0; i < 300; ++i) scan.ranges_m.push_back(i % 3 == 0 ? 0.0F : 5.0F + 0.01F * i);
    scan.num_ranges = 300;
    send("LIDAR_SCAN", scan);

    gnss_t fix{};
    fix.utime = utime_;
    fix.seq = k;
    fix.valid = 1;
    fix.east_m = true_pose(k).x();
    fix.north_m = true_pose(k).y();
    fix.sigma_m = 1.5;
    fix.has_geodetic = static_cast<std::int8_t>(k % 2);
    fix.latitude_deg = 48.1;
    fix.longitude_deg = 11.5;
    fix.altitude_m = 520.0;
    send("GNSS", fix);
    sweep(k);
    detections(k);
  }

  void sweep(int k) {
    model::PointSweep sweep;
    sweep.utime = utime_;
    sweep.revolution = sequence_;
    sweep.is_deskewed = true;
    sweep.rings = 16;
    sweep.max_range_m = 100.0;
    sweep.attitude = model::Attitude{};
    for (int i = 0; i < 500; ++i) {
      sweep.points.push_back({static_cast<float>(real(30.0)), static_cast<float>(real(30.0)), 1.0F,
                              -0.001F * static_cast<float>(500 - i),
                              static_cast<std::uint16_t>(i % 16), 100});
    }
    for (model::PointSweep& part : model::split_sweep(sweep, 200)) {
      part.sequence = static_cast<std::uint64_t>(3 * k) + part.part;
      send("LIDAR_SWEEP", part);
    }
  }

  void detections(int k) {
    model::LandmarkScan scan{utime_, sequence_, {40.0, 0.0, 6.28}, {}};
    const geometry::SE2 vehicle_T_map = true_pose(k).inverse();
    for (std::size_t i = 0; i < kLandmarks; i += 4) {
      const Eigen::Vector2d seen = vehicle_T_map * landmarks_[i].position_m;
      model::Detection detection;
      detection.position_m = {seen.x(), seen.y(), 0.0};
      detection.covariance_m2 = 1e-3 * Eigen::Matrix3d::Identity();
      detection.radius_m = 0.2;
      scan.detections.push_back(detection);
    }
    send("LANDMARKS", scan);
  }

  void poses(int k) {
    const Eigen::Matrix3d covariance =
        Eigen::Vector3d(1e-2, 1e-2, 1e-4).asDiagonal().toDenseMatrix();
    model::RawPose raw{utime_, sequence_, true_pose(k), covariance, false};
    send("RAW_POSE", raw);

    model::EkfPose filter;
    filter.utime = utime_;
    filter.sequence = sequence_;
    filter.ekf_map_T_vehicle = geometry::SE2(3.0, 4.0, 0.5) * true_pose(k);
    filter.covariance = covariance;
    filter.velocity_mps = {5.0, 0.0};
    send("EKF_POSE", filter);

    model::SlamPose pose;
    pose.utime = utime_;
    pose.sequence = sequence_;
    if (k == 0) pose.status = model::MapUpdateStatus::kFirstMap;
    if (k == 0) pose.keyframe_sequence = 0;
    pose.submap_T_vehicle = true_pose(0).inverse() * true_pose(k) * geometry::SE2(0.01, 0.02, 0.0);
    pose.covariance = covariance;
    send("SLAM_POSE", pose);
  }

  /// Two landmarks more; now and then something else.
  void keyframe(int k) {
    model::MapUpdate update;
    update.utime = utime_;
    update.keyframe_sequence = sequence_;
    update.status = k == 0 ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;
    update.chi2 = 8.0;
    update.degrees_of_freedom = 10;
    send("SLAM_UPDATE", update);

    model::MapDelta delta{utime_, version_, version_, version_ + 1, {}, {}, {}, {}};
    ++version_;
    for (int i = 0; i < 2 && next_ < kLandmarks; ++i) add(delta);
    if (map_.size() > 6) change(delta, k);
    send("MAP_DELTA", delta);
    if (k == 50) hand_over();
    existence(k);
  }

  void add(model::MapDelta& delta) {
    map_[landmarks_[next_].id] = landmarks_[next_];
    delta.added.push_back(landmarks_[next_++]);
  }

  void change(model::MapDelta& delta, int k) {
    const auto moved = std::next(map_.begin(), 3);
    moved->second.position_m.x() += 0.05;
    delta.moved.push_back(moved->second);
    if (k % 20 == 0) {
      delta.removed.push_back(map_.begin()->first);
      map_.erase(map_.begin());
    } else if (k % 15 == 0) {
      delta.merged.emplace_back(map_.begin()->first, map_.rbegin()->first);
      map_.erase(map_.begin());
    }
  }

  /// The first three landmarks, in a submap.
  void hand_over() {
    model::Submap submap;
    submap.utime = utime_;
    submap.id = 1;
    submap.map_T_submap = geometry::SE2(1.0, 2.0, 0.3);
    submap.content_hash = model::fnv1a("");
    for (int i = 0; i < 3; ++i) {
      model::MapLandmark landmark = map_.begin()->second;
      landmark.position_m = submap.map_T_submap.inverse() * landmark.position_m;
      submap.landmarks.push_back(landmark);
      map_.erase(map_.begin());
    }
    send("SUBMAP", submap);
    send("MAP_CORRECTION", model::MapCorrection{utime_, 0, 1, 1, {{1, submap.map_T_submap}}});

    model::LoopClosure closure;
    closure.utime = utime_;
    closure.id = 1;
    closure.source = "manual";
    closure.from = {0, 1};
    closure.to = {0, 2};
    closure.from_T_to.covariance = Eigen::Matrix3d::Identity();
    send("LOOP_CLOSURE", closure);
    send("LOOP_RESULT",
         model::LoopResult{utime_, 0, 1, 1, model::LoopResult::Status::kAccepted, ""});
  }

  void existence(int k) {
    model::Existence existence;
    existence.utime = utime_;
    existence.sequence = sequence_ / 5;
    for (const auto& [id, landmark] : map_) {
      if (existence.landmarks.size() == 4) break;
      existence.landmarks.push_back({id, 0.05 + 0.9 * std::abs(std::sin(k)), k % 3 != 0});
    }
    existence.known = static_cast<std::uint32_t>(existence.landmarks.size());
    existence.missing_share = 0.1;
    existence.new_share = 0.2;
    send("EXISTENCE", existence);
  }

  void processes(int k) {
    health_t health{};
    health.utime = utime_;
    health.process = k % 20 == 0 ? "ekf" : "associator";
    health.state = health_t::STATE_OK;
    health.latency_p99_us = 1500;
    health.message_utime = utime_;
    health.channels.push_back({});
    health.channels[0].channel = "LANDMARKS";
    health.channels[0].rate_hz = 10.0;
    health.num_channels = 1;
    send("HEALTH", health);

    log_t line{};
    line.utime = utime_;
    line.process = "ekf";
    line.level = log_t::LEVEL_WARNING;
    line.code = "late";
    line.text = "a \"text\" with \\ and a\ttab and \xff";
    send("LOG", line);
  }

  model::WholeMap whole_map() const {
    model::WholeMap map;
    map.utime = utime_;
    map.version = version_;
    for (const auto& [id, landmark] : map_) map.landmarks.push_back(landmark);
    map.keyframes.push_back({0, utime_, {}, Eigen::Matrix3d::Identity()});
    return map;
  }

  std::vector<io::LogEvent> events_;
  std::mt19937_64 random_{3};
  std::vector<model::MapLandmark> landmarks_;
  std::map<model::LandmarkId, model::MapLandmark> map_;
  std::size_t next_ = 0;
  std::uint64_t version_ = 0;
  std::int64_t utime_ = kStart_us;
  std::uint64_t sequence_ = 0;
};

}  // namespace

std::vector<io::LogEvent> synthetic_drive(int scans) { return Drive().run(scans); }

}  // namespace understory::test
