// Drives of the whole filter with the truth beside.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "services/ekf/ekf.hpp"
#include "sim/inertial_drive.hpp"

namespace understory::test {

/// Trunks that all tests share.
inline const sim::TrunkField& trunks() {
  static const sim::TrunkField field = [] {
    sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
    forest.side_m = 300.0;
    return sim::make_trunk_field(forest, 1);
  }();
  return field;
}

/// A short drive through few trunks, so that tests are quick.
inline sim::InertialDriveParameters short_drive() {
  sim::InertialDriveParameters drive;
  drive.loop_length_m = 500.0;
  drive.stationary_s = 2.0;
  drive.range_m = 18.0;
  return drive;
}

/// A filter for detections whose noise is all new in every scan, and whose distances are right.
inline ekf::EkfParameters white_noise() {
  ekf::EkfParameters parameters;
  parameters.observation.correlated_share = 0.0;
  parameters.observation.scale_sigma = 0.0;
  return parameters;
}

/// The scan under its true identities (`offset` makes other ids of the same landmarks).
inline model::TrackedScan true_tracks(const sim::DriveStep& step, model::TrackId offset = 1) {
  model::TrackedScan tracked{step.scan.utime, step.scan.sequence, step.scan.field_of_view, {}};
  for (std::uint32_t i = 0; i < step.scan.detections.size(); ++i) {
    if (step.trunks[i] < 0) continue;
    tracked.landmarks.push_back(
        {static_cast<model::TrackId>(step.trunks[i]) + offset, i, step.scan.detections[i]});
  }
  return tracked;
}

/// Squared Mahalanobis distance of the pose's error.
inline double nees(const model::EkfPose& pose, const geometry::SE2& truth) {
  const Eigen::Vector3d error = (pose.ekf_map_T_vehicle.inverse() * truth).Log();
  const Eigen::Matrix3d covariance = pose.covariance + 1e-14 * Eigen::Matrix3d::Identity();
  return error.dot(covariance.llt().solve(error));
}

struct DriveEnd {
  double mean_nees = 0.0;  ///< Over the moving scans.
  double last_nees = 0.0;  ///< Over the last quarter.
  double drift = 0.0;      ///< Error at the end, of the distance driven.
  std::size_t most_landmarks = 0;
};

inline DriveEnd drive_through(const sim::InertialDriveParameters& parameters,
                              const ekf::EkfParameters& filter_parameters, double seconds,
                              std::uint64_t seed) {
  sim::InertialDrive drive(parameters, trunks(), seed);
  ekf::Ekf filter(filter_parameters);
  DriveEnd end;
  const int scans = static_cast<int>(seconds / parameters.scan_interval_s);
  const int still = static_cast<int>(parameters.stationary_s / parameters.scan_interval_s) + 20;
  geometry::SE2 start;
  for (int k = 0; k < scans; ++k) {
    const sim::DriveStep step = drive.next();
    if (k == 0) start = step.world_T_vehicle;
    for (const model::Odometry& increment : step.odometry) filter.add(increment);
    const ekf::EkfOutput output = filter.add(true_tracks(step));
    const geometry::SE2 truth = start.inverse() * step.world_T_vehicle;
    const double now = nees(*output.pose, truth);
    if (k >= still) end.mean_nees += now / (scans - still);
    if (k >= scans - scans / 4) end.last_nees += now / (scans / 4);
    end.drift = (truth.inverse() * output.pose->ekf_map_T_vehicle).translation().norm() /
                std::max(1.0, step.driven_m);
    end.most_landmarks = std::max(end.most_landmarks, output.map->landmarks.size());
  }
  return end;
}

/// A filter after some seconds of driving, with the drive to go on with.
struct Driven {
  sim::InertialDrive drive;
  ekf::Ekf filter;
  geometry::SE2 start;
  sim::DriveStep step;

  Driven(double seconds, const sim::InertialDriveParameters& parameters,
         const ekf::EkfParameters& filter_parameters = {}, std::uint64_t seed = 7)
      : drive(parameters, trunks(), seed), filter(filter_parameters) {
    step = drive.next();
    start = step.world_T_vehicle;
    filter.add(true_tracks(step));
    for (int k = 0; k < static_cast<int>(10 * seconds); ++k) go();
  }
  /// `reported_stationary`: as a detector may report wrongly.
  ekf::EkfOutput go(model::TrackId offset = 1, bool reported_stationary = false) {
    step = drive.next();
    for (model::Odometry increment : step.odometry) {
      increment.is_stationary = increment.is_stationary || reported_stationary;
      filter.add(increment);
    }
    return filter.add(true_tracks(step, offset));
  }
  geometry::SE2 truth() const { return start.inverse() * step.world_T_vehicle; }
};

}  // namespace understory::test
