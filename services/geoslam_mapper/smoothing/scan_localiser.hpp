// Poses of single scans between keyframes.
#pragma once

#include <optional>

#include "common/geometry/registration.hpp"
#include "common/model/archive.hpp"
#include "common/model/level.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A scan with the pose that was found for it.
struct LocatedScan {
  model::Utime utime = 0;
  geometry::SE2 map_T_vehicle;
  geometry::SE2 step;                                    ///< From the scan before.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Among the landmarks near by.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.map_T_vehicle, s.step, s.covariance);
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
  /// later scan was located already. `covariance`: among the landmarks near by (right
  /// perturbation).
  void restart_at(model::Utime utime, const geometry::SE2& map_T_vehicle,
                  const Eigen::Matrix3d& covariance);

  /// map_T_vehicle of the scan, with its covariance in the map. None before the first keyframe, for
  /// a scan not later than the last one, and where too few detections match. O(landmarks in range).
  std::optional<geometry::SE2WithCovariance> locate(const model::LandmarkScan& scan,
                                                    const LandmarkMap& landmarks,
                                                    const Motion& motion);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.level_, self.latest_);
  }

 private:
  std::optional<geometry::Registration> register_scan(const model::LandmarkScan& scan,
                                                      const LandmarkMap& landmarks,
                                                      const Motion& motion) const;

  SmoothingMapperParameters parameters_;
  model::LevelCorrection level_;
  std::optional<LocatedScan> latest_;
};

}  // namespace understory::geoslam_mapper::smoothing
