#include "eval/experiments/victoria_park/victoria_park.hpp"

#include <chrono>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::eval::experiments::victoria_park {
namespace {

/// Calls `work` and writes down how long it took.
template <class Work>
auto timed(std::vector<double>& seconds, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  seconds.push_back(
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return result;
}

std::vector<metrics::StampedPose> compound_all(std::span<const model::Odometry> odometry) {
  std::vector<metrics::StampedPose> poses;
  for (const model::Odometry& increment : odometry) {
    if (poses.empty()) poses.push_back({increment.from_utime, {}});
    poses.push_back({increment.utime, poses.back().pose * increment.from_T_to});
  }
  return poses;
}

/// Keyframer and mapper, fed scan by scan.
class Drive {
 public:
  Drive(const VictoriaParkConfig& config, VictoriaParkRun& run)
      : run_(run),
        extractor_(config.extractor),
        keyframer_(config.keyframer),
        mapper_(config.mapper) {}

  void add(const model::Odometry& odometry) {
    keyframer_.add(odometry);
    mapper_.add(odometry);
  }

  void add(const model::PlanarScan& scan) {
    const model::LandmarkScan landmarks =
        timed(run_.times.extractor_s, [&] { return extractor_.extract(scan); });
    run_.detections += landmarks.detections.size();
    const auto keyframe = timed(run_.times.keyframer_s, [&] { return keyframer_.add(landmarks); });
    if (!keyframe) {
      run_.times.mapper_s.push_back(0.0);
      return;
    }
    run_.updates.push_back(timed(run_.times.mapper_s, [&] { return mapper_.add(*keyframe); }));
    const model::MapUpdate& update = run_.updates.back();
    if (metrics::localised(update)) run_.live.push_back({update.utime, update.map_T_vehicle});
  }

  void finish() {
    std::vector<metrics::StampedPose> keyframes;
    for (const model::KeyframePose& pose : mapper_.trajectory()) {
      keyframes.push_back({pose.utime, pose.map_T_vehicle});
    }
    run_.trajectory = fill_between(keyframes, run_.dead_reckoned);
    run_.landmarks = mapper_.landmarks();
    run_.keyframes_withheld = keyframer_.counters().keyframes_withheld;
    run_.last_withheld_reason = keyframer_.counters().last_reason;
  }

 private:
  VictoriaParkRun& run_;
  landmark_extractor::LandmarkExtractor extractor_;
  keyframer::joint::JointKeyframer keyframer_;
  geoslam_mapper::smoothing::SmoothingMapper mapper_;
};

}  // namespace

VictoriaParkConfig victoria_park_defaults() {
  VictoriaParkConfig config;
  config.mapper.use_odometry = true;
  return config;
}

std::vector<model::Odometry> victoria_park_odometry(const io::VictoriaPark& recording) {
  lidar_imu_input::WheelOdometryParameters parameters;
  parameters.car = {io::victoria_park::kWheelbase_m, io::victoria_park::kEncoderLeft_m,
                    io::victoria_park::axle_T_vehicle()};
  lidar_imu_input::WheelOdometry wheels(parameters);
  std::vector<model::Odometry> odometry;
  auto sample = recording.wheels.begin();
  for (const model::PlanarScan& scan : recording.scans) {
    for (; sample != recording.wheels.end() && sample->utime <= scan.utime; ++sample) {
      wheels.add(*sample);
    }
    if (const auto motion = wheels.advance_to(scan.utime)) odometry.push_back(*motion);
  }
  return odometry;
}

VictoriaParkRun drive_victoria_park(const io::VictoriaPark& recording,
                                    const VictoriaParkConfig& config,
                                    const std::function<void()>& progress) {
  VictoriaParkRun run;
  run.odometry = victoria_park_odometry(recording);
  run.dead_reckoned = compound_all(run.odometry);
  Drive drive(config, run);
  auto motion = run.odometry.begin();
  for (const model::PlanarScan& scan : recording.scans) {
    for (; motion != run.odometry.end() && motion->utime <= scan.utime; ++motion)
      drive.add(*motion);
    drive.add(scan);
    progress();
  }
  drive.finish();
  return run;
}

}  // namespace understory::eval::experiments::victoria_park
