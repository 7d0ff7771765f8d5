// The input stage on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::lidar_imu_input {

/// Names of the channels; every one can be replaced, for tests and for two vehicles on one bus.
struct LidarImuInputChannels {
  std::string raw_imu = "RAW_IMU";
  std::string raw_wheels = "RAW_WHEELS";
  std::string raw_gnss = "RAW_GNSS";
  std::string raw_sweep = "RAW_SWEEP";
  std::string raw_scan = "RAW_SCAN";
  std::string velocity_correction = "VELOCITY_CORRECTION";
  std::string ekf_pose = "EKF_POSE";
  std::string imu = "IMU";
  std::string wheels = "WHEELS";
  std::string gnss = "GNSS";
  std::string odometry = "ODOMETRY";
  std::string rest_level = "REST_LEVEL";
  std::string raw_pose = "RAW_POSE";
  std::string lidar_sweep = "LIDAR_SWEEP";
  std::string lidar_scan = "LIDAR_SCAN";
};

/// The service, for run_service() and replay. It refuses to start with parameters out of range.
bus::Service lidar_imu_input_service(const LidarImuInputChannels& channels = {});

}  // namespace understory::lidar_imu_input
