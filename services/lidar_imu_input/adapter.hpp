// The input stage on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::lidar_imu_input {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct LidarImuInputChannels {
  bus::ChannelList all;
  std::string raw_imu = all.in("RAW_IMU", "angular rate and specific force, frame sensor");
  std::string raw_wheels = all.in("RAW_WHEELS", "speed and steering");
  std::string raw_gnss = all.in("RAW_GNSS", "fixes, for reference only");
  std::string raw_sweep = all.in("RAW_SWEEP", "sweeps of the laser as measured, in parts");
  std::string raw_scan = all.in("RAW_SCAN", "scans of a one-plane laser");
  std::string velocity_correction =
      all.in("VELOCITY_CORRECTION", "correction of RAW_POSE by the filter");
  std::string ekf_pose =
      all.in("EKF_POSE", "motion of the filter, for a laser without IMU and wheels");
  std::string imu = all.out("IMU", "checked, frame vehicle");
  std::string wheels = all.out("WHEELS", "checked");
  std::string gnss = all.out("GNSS", "checked");
  std::string odometry = all.out("ODOMETRY", "motion without landmarks");
  std::string rest_level =
      all.out("REST_LEVEL", "level error of the stationary vehicle, learned from motion");
  std::string raw_pose = all.out("RAW_POSE", "dead reckoning");
  std::string lidar_sweep = all.out("LIDAR_SWEEP", "de-skewed sweeps with attitude, in parts");
  std::string lidar_scan = all.out("LIDAR_SCAN", "scans of the one-plane laser, checked");
};

/// The service, for run_service() and replay. It refuses to start with parameters out of range.
bus::Service lidar_imu_input_service(const LidarImuInputChannels& channels = {});

}  // namespace understory::lidar_imu_input
