// Score of trunks and corners from a laser with one plane on a vehicle that drives and turns.
#pragma once

#include <cstdint>

#include "eval/experiments/frontend/kind_tally.hpp"

namespace understory::eval::experiments::frontend {

/// A vehicle on a circle among trunks and houses.
struct PlanarDriveOptions {
  double speed_mps = 5.0;
  double yaw_rate_rad_s = 0.5236;  ///< 30 degrees/s.
  double revolution_s = 0.1;       ///< Of the laser; half of it measures.
  bool has_beam_times = true;      ///< False: scans are taken as they are.
  bool has_motion_sensors = true;  ///< IMU and wheels; false: the laser alone.
  int scans = 150;                 ///< After the vehicle has reached its speed.
  std::uint64_t seed = 1;
};

/// What the extractor found behind lidar_imu_input.
struct PlanarScore {
  std::uint64_t scans = 0;
  std::uint64_t not_deskewed = 0;  ///< Of all scans, those that HEALTH says `no_motion` of.
  KindScore trunks;
  KindScore corners;
};

/// Drives once through both stages. Trunks are round, upright and of known noise, walls flat.
PlanarScore score_planar_drive(const PlanarDriveOptions& options);

}  // namespace understory::eval::experiments::frontend
