// Consistency of the filter: errors on simulated drives against the filter's own covariance.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "services/associator/parameters.hpp"
#include "services/ekf/parameters.hpp"
#include "sim/inertial_drive.hpp"

namespace understory::eval::experiments::frontend {

/// Filter for simulated detections: their noise is independent in every scan and distances have no
/// common scale error.
inline ekf::EkfParameters white_noise_filter() {
  ekf::EkfParameters parameters;
  parameters.observation.correlated_share = 0.0;
  parameters.observation.scale_sigma = 0.0;
  return parameters;
}

/// One simulated drive through associator and filter.
struct EkfDriveOptions {
  sim::InertialDriveParameters drive;
  ekf::EkfParameters filter = white_noise_filter();
  associator::AssociatorParameters associator;
  /// Track ids from the associator; else the true ones.
  bool use_associator = true;
  double duration_s = 60.0;  ///< Including the stationary start.
};

/// One drive.
struct EkfDriveResult {
  std::vector<double> nees;           ///< Of the pose (3 degrees of freedom), per scan.
  std::vector<double> heading_nees;   ///< Of the heading alone (1).
  std::vector<double> position_nees;  ///< Of the position alone (2).
  std::vector<double> velocity_nees;  ///< Of velocity and biases (5), per scan.
  std::vector<double> error_m2;       ///< Squared error of the position, per scan.
  std::vector<double> claimed_m2;     ///< The filter's variance of it.
  double final_error_m = 0.0;
  double final_error_rad = 0.0;
  double driven_m = 0.0;
  std::vector<double> update_s;  ///< Time of each scan's update.
  std::uint64_t restarts = 0;
  std::uint64_t landmarks_refused = 0;
  std::uint64_t landmarks_used = 0;
  double mean_active_landmarks = 0.0;
};
/// Drives once through `world`; everything follows from `seed`.
EkfDriveResult run_ekf_drive(const EkfDriveOptions& options, const sim::TrunkField& world,
                             std::uint64_t seed);

/// Appends a pose's figures; `truth` is the pose in the filter's map.
void add_pose_nees(const model::EkfPose& pose, const geometry::SE2& truth, EkfDriveResult& result);

/// Many drives.
struct EkfConsistency {
  int runs = 0;
  std::vector<double> mean_nees;  ///< Per scan, over the runs; 3 is exact.
  double band_low = 0.0;          ///< 95 % band of such a mean.
  double band_high = 0.0;
  double overall_nees = 0.0;           ///< Mean over scans and runs.
  double heading_nees = 0.0;           ///< Likewise; 1 is exact.
  double position_nees = 0.0;          ///< Likewise; 2 is exact.
  double final_nees = 0.0;             ///< At the last scan.
  double overall_velocity_nees = 0.0;  ///< 5 is exact.
  double drift_percent = 0.0;          ///< RMS error at the end, of the distance driven.
  double driven_m = 0.0;               ///< Mean.
  double update_p50_s = 0.0;
  double update_p99_s = 0.0;
  double mean_active_landmarks = 0.0;
  double refused_share = 0.0;  ///< Of the landmarks offered.
  std::uint64_t restarts = 0;
};
/// The figures of many drives, which have the same scans; empty where there are none.
EkfConsistency summarise(const std::vector<EkfDriveResult>& runs);

/// Scans from `first` to before `last`.
struct ScanRange {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Share of (group of runs, scan) whose mean NEES lies in the 95 % band of such a mean. One group
/// of all runs shows the least bias; but errors last for many scans, so that its share may be far
/// from 95 % by chance. Many groups have the share of a consistent filter close to 95 %.
double share_in_band(std::span<const EkfDriveResult> runs, ScanRange scans, std::size_t group);
/// Mean NEES of the pose over those scans of all runs; 3 is exact.
double mean_nees(std::span<const EkfDriveResult> runs, ScanRange scans);

}  // namespace understory::eval::experiments::frontend
