// The latest data of the sensors.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/viewer/part.hpp"

namespace understory::viewer {

/// The latest data of the sensors.
struct SceneScan {
  std::int64_t utime = 0;
  std::vector<std::array<float, 3>> points_m;  ///< Frame vehicle.
  std::vector<model::Detection> detections;    ///< Frame vehicle_level.
};

/// The newest detections and points; of many points every n-th.
class ShownScan {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownScan(Change& changes) : changes_(&changes) {}

  /// Adds the detections of a scan.
  void take(const model::LandmarkScan& scan);
  /// Adds the points of a one-plane laser.
  void take(const model::PlanarScan& scan, const geometry::SE2& vehicle_T_sensor);
  /// Adds the next points of a revolution; a new revolution replaces the last.
  void take(const model::PointSweep& part);
  /// Removes all.
  void clear() { scan_.changed(*changes_) = {}; }

  /// For the page.
  const Part<SceneScan>& part() const { return scan_; }

 private:
  Change* changes_;
  Part<SceneScan> scan_;
  std::uint64_t revolution_ = 0;  ///< Of the sweep in scan_.
};

}  // namespace understory::viewer
