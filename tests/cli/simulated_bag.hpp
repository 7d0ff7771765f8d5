// A simulated drive as the messages of a bag, and as those of the log that the bag must become.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "deploy/cli/sensor_simulation.hpp"
#include "tests/bag/bag_writer.hpp"

namespace understory::test {

inline Eigen::Isometry3d place(double x, double y, double z, double yaw = 0.0) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

/// A cloud as Ouster's driver sends it, unordered.
inline bag::PointCloud cloud_of(const bag::Header& header, const model::PointSweep& sweep,
                                std::vector<std::uint8_t>& data) {
  bag::PointCloud cloud;
  cloud.header = header;
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(sweep.points.size());
  cloud.fields = {{"x", 0, 7, 1},          {"y", 4, 7, 1},  {"z", 8, 7, 1},
                  {"intensity", 16, 7, 1}, {"t", 20, 6, 1}, {"ring", 24, 4, 1}};
  cloud.point_step = 32;
  cloud.row_step = 32 * cloud.width;
  data.assign(cloud.row_step, 0);
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const model::SweepPoint& point = sweep.points[i];
    std::uint8_t* at = data.data() + 32 * i;
    const float numbers[] = {point.x_m, point.y_m, point.z_m};
    const auto intensity = static_cast<float>(point.intensity);
    const auto time =
        static_cast<std::uint32_t>(std::llround(1e9 * static_cast<double>(point.time_s)));
    std::memcpy(at, numbers, sizeof numbers);
    std::memcpy(at + 16, &intensity, 4);
    std::memcpy(at + 20, &time, 4);
    std::memcpy(at + 24, &point.ring, 2);
  }
  cloud.data = data;
  return cloud;
}

/// What the simulated sensors gave, for a log and for a bag.
struct SimulatedDrive {
  std::map<std::string, std::vector<wire::Bytes>> log;
  std::map<bag::Encoding, std::vector<Recorded>> bag;
  std::vector<Eigen::Vector2d> latitude_longitude_deg;  ///< Of the fixes.

  template <class Message>
  void add_to_log(const std::string& channel, const Message& message) {
    log[channel].push_back(wire::encode_message(message));
  }
};

class SimulatedBag {
 public:
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

  /// The beginning of a drive through a forest.
  static SimulatedDrive record(double seconds, std::vector<bag::Encoding> encodings = {
                                                   bag::Encoding::kRos1, bag::Encoding::kCdr}) {
    cli::SensorSimulationOptions options;
    options.world = "forest3d";
    options.lidar = "vlp16";
    options.standstill_s = std::min(3.0, 0.25 * seconds);  // At rest the IMU is calibrated.
    sim::SensorDrive drive = cli::make_sensor_drive(options);
    SimulatedBag recorder;
    recorder.encodings_ = std::move(encodings);
    recorder.add_mounts();
    while (auto reading = drive.next()) {
      if (cli::complete_at(*reading, drive) > static_cast<model::Utime>(1e6 * seconds)) break;
      recorder.now_ns_ = 1000 * cli::complete_at(*reading, drive) + kStart_ns;
      std::visit([&](auto& value) { recorder.take(value); }, *reading);
    }
    return std::move(recorder.drive_);
  }

 private:
  template <class Make>
  void add(const std::string& topic, const std::string& type, Make make) {
    for (const auto encoding : encodings_)
      drive_.bag[encoding].push_back({topic, type, now_ns_, make(Serialisation{encoding, false})});
  }
  bag::Header header(model::Utime utime, const std::string& frame) { return {utime * 1000, frame}; }
  void add_mounts() {
    now_ns_ = kStart_ns;
    std::vector<bag::Pose> transforms;
    transforms.push_back(frame_in("base_link", "mast", place(1.0, 0.0, 1.0)));
    transforms.push_back(frame_in("/mast", "laser", place(0.2, 0.0, 0.9)));
    transforms.push_back(frame_in("base_link", "imu", place(1.0, 0.0, 0.6)));
    add("/tf_static", "tf2_msgs/TFMessage",
        [&](const Serialisation& how) { return transforms_message(how, transforms); });
  }
  void take(model::ImuSample& imu) {
    imu.utime += kStart_ns / 1000;
    drive_.add_to_log("RAW_IMU", imu);
    add("/imu/data", "sensor_msgs/Imu", [&](const Serialisation& how) {
      return imu_message(
          how, {header(imu.utime, "imu"), imu.angular_rate_rad_s, imu.specific_force_mps2});
    });
  }
  void take(model::WheelSample& wheels) {
    wheels.utime += kStart_ns / 1000;
    wheels.steering_rad = 0.0;
    drive_.add_to_log("RAW_WHEELS", wheels);
    add("/odom", "nav_msgs/Odometry", [&](const Serialisation& how) {
      return odometry_message(how, {{header(wheels.utime, "odom"), "base_link", place(0, 0, 0)},
                                    {wheels.speed_mps, 0.0, 0.0},
                                    Eigen::Vector3d::Zero()});
    });
  }
  void take(model::GnssFix& fix) {
    fix.utime += kStart_ns / 1000;
    const Eigen::Vector2d place_deg(48.0 + fix.east_north_m.y() / 111'200.0,
                                    9.0 + fix.east_north_m.x() / 74'490.0);
    drive_.latitude_longitude_deg.push_back(place_deg);
    add("/fix", "sensor_msgs/NavSatFix", [&](const Serialisation& how) {
      return fix_message(
          how, {header(fix.utime, "gnss"), true, place_deg.x(), place_deg.y(), 500.0, 2.0});
    });
  }
  void take(sim::TruePose& pose) {
    add("/reference", "geometry_msgs/PoseStamped", [&](const Serialisation& how) {
      const geometry::SE2 world_T_vehicle = pose.state.world_T_level();
      return pose_message(
          how, {header(pose.utime + kStart_ns / 1000, "map"), "",
                place(world_T_vehicle.x(), world_T_vehicle.y(), 0.0, world_T_vehicle.theta())});
    });
  }
  void take(sim::SimulatedPlanarScan& /*scan*/) {}
  void take(sim::SimulatedSweep& sweep) {
    model::PointSweep& raw = sweep.raw;
    raw.utime += kStart_ns / 1000;
    // Whole steps of the wire's times: what the parts of a sweep are rounded to.
    for (model::SweepPoint& point : raw.points)
      point.time_s =
          static_cast<float>(4e-6 * std::round(static_cast<double>(point.time_s) / 4e-6));
    for (model::PointSweep& part : split_sweep(raw, 5900)) {
      part.sequence = parts_++;
      drive_.add_to_log("RAW_SWEEP", part);
    }
    std::vector<std::uint8_t> data;
    const bag::PointCloud cloud = cloud_of(header(raw.utime, "laser"), raw, data);
    add("/points", "sensor_msgs/PointCloud2",
        [&](const Serialisation& how) { return cloud_message(how, cloud); });
  }

  SimulatedDrive drive_;
  std::vector<bag::Encoding> encodings_;
  std::int64_t now_ns_ = 0;
  std::uint64_t parts_ = 0;
};

}  // namespace understory::test
