// The input stage's parameters as a list: units, ranges, meanings.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Position of the wheels: scalars of `CarGeometry::axle_T_vehicle`, combined after loading.
struct AxlePlace {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};

/// Adds every parameter to the table, with unit, range and meaning. Both structs must outlive it.
void describe(LidarImuInputParameters& parameters, AxlePlace& axle_T_vehicle,
              bus::ParameterTable& table);

}  // namespace understory::lidar_imu_input
