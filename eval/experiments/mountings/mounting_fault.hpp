// A sensor that is mounted otherwise than configured, or whose driver has another unit or sign.
#pragma once

#include <Eigen/Core>
#include <random>
#include <string>
#include <vector>

#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/wheels.hpp"

namespace understory::eval::experiments::mountings {

/// The sensor that a fault is in.
enum class Culprit { kNone, kImu, kLidar, kWheels };
/// "IMU", "LIDAR", "wheels".
std::string to_string(Culprit culprit);

/// What is done to every reading of one sensor. As constructed it is no fault.
struct MountingFault {
  Culprit culprit = Culprit::kNone;
  std::string kind = "none";  ///< For the table: one line for each.
  std::string value;          ///< What was drawn, for people.

  Eigen::Matrix3d rate = Eigen::Matrix3d::Identity();   ///< Applied to the IMU's rate.
  Eigen::Matrix3d force = Eigen::Matrix3d::Identity();  ///< Applied to its force.

  Eigen::Matrix3d points = Eigen::Matrix3d::Identity();  ///< Applied to a sweep's points.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();     ///< Added to them, frame sensor.
  double late_s = 0.0;                                   ///< Added to a sweep's stamp.
  bool reversed_times = false;  ///< The laser is said to turn the other way.
  bool reversed_rings = false;  ///< Beams are counted from above.

  double speed = 1.0;     ///< Factor of the wheels' speed.
  double steering = 1.0;  ///< Factor of the steering angle.
};

/// What `fault` makes of a reading of its sensor.
void apply(const MountingFault& fault, model::ImuSample& sample);
void apply(const MountingFault& fault, model::WheelSample& sample);
void apply(const MountingFault& fault, model::PointSweep& sweep);

/// Names of all kinds, in order of the sensors.
std::vector<std::string> mounting_kinds();
/// One fault of a kind, its size drawn at random. Throws std::invalid_argument for another name.
MountingFault draw_fault(const std::string& kind, std::mt19937_64& random);

}  // namespace understory::eval::experiments::mountings
