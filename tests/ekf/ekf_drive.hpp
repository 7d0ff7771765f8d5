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
  drive.standing_s = 2.0;
  drive.range_m = 18.0;
  return drive;
}

/// A filter for detections whose noise is all new in every scan, and whose distances are right.
inline EkfParameters white_noise() {
  EkfParameters parameters;
  parameters.sighting.lasting_share = 0.0;
  parameters.sighting.scale_sigma = 0.0;
  return parameters;
}

/// The scan under its true identities (`offset` makes other ids of the same landmarks).
inline TrackedScan true_tracks(const sim::DriveStep& step, TrackId offset = 1) {
  TrackedScan tracked{step.scan.utime, step.scan.sequence, step.scan.field_of_view, {}};
  for (std::uint32_t i = 0; i < step.scan.detections.size(); ++i) {
    if (step.trunks[i] < 0) continue;
    tracked.landmarks.push_back(
        {static_cast<TrackId>(step.trunks[i]) + offset, i, step.scan.detections[i]});
  }
  return tracked;
}

/// Squared Mahalanobis distance of the pose's error.
inline double nees(const EkfPose& pose, const SE2& truth) {
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
                              const EkfParameters& filter_parameters, double seconds,
                              std::uint64_t seed) {
  sim::InertialDrive drive(parameters, trunks(), seed);
  Ekf filter(filter_parameters);
  DriveEnd end;
  const int scans = static_cast<int>(seconds / parameters.scan_interval_s);
  const int still = static_cast<int>(parameters.standing_s / parameters.scan_interval_s) + 20;
  SE2 start;
  for (int k = 0; k < scans; ++k) {
    const sim::DriveStep step = drive.next();
    if (k == 0) start = step.world_T_vehicle;
    for (const Odometry& piece : step.odometry) filter.add(piece);
    const EkfOutput output = filter.add(true_tracks(step));
    const SE2 truth = start.inverse() * step.world_T_vehicle;
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
  Ekf filter;
  SE2 start;
  sim::DriveStep step;

  Driven(double seconds, const sim::InertialDriveParameters& parameters,
         const EkfParameters& filter_parameters = {}, std::uint64_t seed = 7)
      : drive(parameters, trunks(), seed), filter(filter_parameters) {
    step = drive.next();
    start = step.world_T_vehicle;
    filter.add(true_tracks(step));
    for (int k = 0; k < static_cast<int>(10 * seconds); ++k) go();
  }
  /// `said_to_stand`: as a detector of standing may say wrongly.
  EkfOutput go(TrackId offset = 1, bool said_to_stand = false) {
    step = drive.next();
    for (Odometry piece : step.odometry) {
      piece.is_standing = piece.is_standing || said_to_stand;
      filter.add(piece);
    }
    return filter.add(true_tracks(step, offset));
  }
  SE2 truth() const { return start.inverse() * step.world_T_vehicle; }
};

}  // namespace understory::test
