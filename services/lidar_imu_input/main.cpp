// The input stage as a process: every channel that it touches, besides HEALTH, LOG and CONFIG.
#include "services/lidar_imu_input/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::lidar_imu_input::lidar_imu_input_service({
          .raw_imu = "RAW_IMU",        // in: rate and force, frame sensor
          .raw_wheels = "RAW_WHEELS",  // in: speed and steering
          .raw_gnss = "RAW_GNSS",      // in: fixes, for reference
          .raw_sweep = "RAW_SWEEP",    // in: sweeps of the laser, skewed, in parts
          .raw_scan = "RAW_SCAN",      // in: scans of a one-plane laser
          .velocity_correction = "VELOCITY_CORRECTION",  // in: the filter's correction of RAW_POSE
          .ekf_pose = "EKF_POSE",        // in: the filter's motion, for a laser alone
          .imu = "IMU",                  // out: frame vehicle
          .wheels = "WHEELS",            // out: checked
          .gnss = "GNSS",                // out: checked
          .odometry = "ODOMETRY",        // out: motion without landmarks
          .rest_level = "REST_LEVEL",    // out: what motion showed of the level at rest
          .raw_pose = "RAW_POSE",        // out: dead reckoning
          .lidar_sweep = "LIDAR_SWEEP",  // out: de-skewed, with attitude, in parts
          .lidar_scan = "LIDAR_SCAN",    // out: as they are
      }),
      argc, argv);
}
