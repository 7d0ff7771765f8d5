// Poses of single scans between keyframes.
#pragma once

#include <optional>

#include "common/geometry/registration.hpp"
#include "common/model/archive.hpp"
#include "common/model/level.hpp"
#include "services/geoslam_mapper/mapper_output.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"
#include "services/geoslam_mapper/smoothing/velocity_track.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A scan with the pose that was found for it.
struct LocatedScan {
  model::Utime utime = 0;
  geometry::SE2 map_T_vehicle;
  geometry::SE2 step;                                        ///< From the scan before.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();      ///< Among the landmarks near by.
  Eigen::Matrix3d map_covariance = Eigen::Matrix3d::Zero();  ///< In the map.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.map_T_vehicle, s.step, s.covariance, s.map_covariance);
  }
};

/// Registers each scan to the landmarks around the last one. The map is not changed.
class ScanLocaliser {
 public:
  /// No scan yet. `parameters` gives the gates and how many matches are enough.
  explicit ScanLocaliser(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// The filter's estimate of the level error, by which later scans are levelled.
  void set(const model::EkfLevel& level) { level_.set(level); }
  /// The latest estimate of the level error; none before the first.
  const std::optional<model::EkfLevel>& level() const { return level_.latest(); }

  /// The pose of a keyframe's last scan: known better now than when that scan came. Ignored where a
  /// later scan was located already. Its covariance is among the landmarks near by (right
  /// perturbation); these share the error of the keyframe's base. `common`: see locate().
  void restart_at(model::Utime utime, const geometry::SE2WithCovariance& map_T_vehicle,
                  const geometry::SE2WithCovariance& map_T_base, const Eigen::Matrix3d& common);

  /// map_T_vehicle of the scan, with its covariance in the map. Where too few detections match it
  /// is by odometry, from the last scan that was located. None before the first keyframe, for a
  /// scan not later than the last one, and where odometry has a gap. O(landmarks in range).
  /// `common`: added to the covariance of a pose that landmarks gave, since they share that error.
  std::optional<ScanPose> locate(const model::LandmarkScan& scan, const LandmarkMap& landmarks,
                                 const Motion& motion, const Eigen::Matrix3d& common);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.level_, self.latest_, self.velocity_);
  }

 private:
  std::optional<geometry::Registration> register_scan(const model::LandmarkScan& scan,
                                                      const LandmarkMap& landmarks,
                                                      const Motion& motion);

  SmoothingMapperParameters parameters_;
  model::LevelCorrection level_;
  std::optional<LocatedScan> latest_;
  VelocityTrack velocity_;
};

}  // namespace understory::geoslam_mapper::smoothing
