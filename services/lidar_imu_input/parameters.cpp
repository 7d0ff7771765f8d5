#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

Eigen::Quaterniond SensorMount::rotation() const {
  return Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()));
}

Eigen::Isometry3d SensorMount::vehicle_T_sensor() const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation().toRotationMatrix();
  pose.translation() = position_m();
  return pose;
}

}  // namespace understory::lidar_imu_input
