// What drives through a changing world gave: looks at the points of a map, and the truth about
// them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/existence/point.hpp"

namespace understory::eval::experiments::existence {

/// A look at a point of the map that was expected in view.
struct LookEvent {
  std::uint32_t point = 0;
  understory::existence::Look look;
  bool is_seen = false;
  bool is_clear = false;  ///< Truth: nothing stands between sensor and place.
  double recall = 0.0;    ///< Truth: of this detector at this range.
};

/// Truth about a point at a drive.
struct PointTruth {
  bool exists = true;
  bool is_scored = false;  ///< Its place was in unobstructed view 10 times, from 3 directions.
  bool is_hidden = false;  ///< It exists, and no look of the drive had a clear line of sight.
};

/// One drive.
struct DriveLooks {
  double time_s = 0.0;
  std::vector<LookEvent> looks;
  std::vector<PointTruth> truth;  ///< By point.
};

/// All drives; the points are those of the first drive's world.
struct History {
  std::vector<Eigen::Vector3f> points_m;
  std::vector<DriveLooks> drives;
  std::size_t mapping_drives = 2;  ///< Before anything changes.
  double gone_share = 0.0;         ///< Truth: of the points, over all changes.
  double pass_recall = 1.0;        ///< Truth: share of drives that can see a point.
  double false_rate = 0.0;         ///< Truth: of looks at nothing.
};

}  // namespace understory::eval::experiments::existence
