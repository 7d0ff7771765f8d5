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

/// A scan with its estimated pose.
struct LocatedScan {
  model::Utime utime = 0;
  geometry::SE2 map_T_vehicle;
  geometry::SE2 step;                                        ///< From the scan before.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();      ///< Relative to the landmarks near by.
  Eigen::Matrix3d map_covariance = Eigen::Matrix3d::Zero();  ///< In the map.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.map_T_vehicle, s.step, s.covariance, s.map_covariance);
  }
};

/// Registers each scan to the landmarks around the last pose. The map is not changed.
class ScanLocaliser {
 public:
  /// No scan yet. `parameters` gives the gates and the least number of matches.
  explicit ScanLocaliser(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Sets the filter's estimate of the level error; later scans are levelled by it.
  void set(const model::EkfLevel& level) { level_.set(level); }
  /// The latest estimate of the level error; none before the first.
  const std::optional<model::EkfLevel>& level() const { return level_.latest(); }

  /// Sets the pose of a keyframe's last scan: more accurate than when that scan arrived. Ignored if
  /// a later scan was localised already. Its covariance is relative to the landmarks near by (right
  /// perturbation); these share the error of the keyframe's base. `common`: see locate().
  void restart_at(model::Utime utime, const geometry::SE2WithCovariance& map_T_vehicle,
                  const geometry::SE2WithCovariance& map_T_base, const Eigen::Matrix3d& common);

  /// map_T_vehicle of the scan, with its covariance in the map. If too few detections match, it is
  /// from odometry since the last localised scan. None before the first keyframe, for a scan not
  /// later than the last one, and if odometry has a gap. O(landmarks in range). `common`: added to
  /// the covariance of a pose from landmarks, since they share that error.
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
