// What loop detectors look at of a sweep: its cloud, levelled and down-sampled.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/model/place_scan.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory::landmark_extractor::place {

/// Of the points within `range_m` in the plan, the one nearest to the middle of each cube with
/// edges of `cube_m`; of more than `most`, every so many in order of cubes. Points that are not
/// finite are left out. O(n log n).
std::vector<model::PlacePoint> down_sampled(const std::vector<Eigen::Vector3f>& points,
                                            const PlaceScanParameters& parameters);

/// The cloud of a de-skewed sweep in `vehicle_level`; one without attitude is taken as level.
model::PlaceScan place_scan_of(const model::PointSweep& sweep,
                               const PlaceScanParameters& parameters);
/// The same of a scan in one plane.
model::PlaceScan place_scan_of(const model::PlanarScan& scan,
                               const PlaceScanParameters& parameters);

/// Which sweeps become a PLACE_SCAN. State: when the last one was made, which begins anew after a
/// restart.
class PlaceScans {
 public:
  /// `parameters`: none are made where the period is 0.
  explicit PlaceScans(const PlaceScanParameters& parameters) : parameters_(parameters) {}

  /// The cloud of a sweep or scan that is due: the first one, what comes `period_s` later, and what
  /// comes earlier than the last one did. Precondition: the extractor did not call it malformed.
  template <class Sweep>
  std::optional<model::PlaceScan> add(const Sweep& sweep) {
    if (!is_due(sweep.utime)) return std::nullopt;
    last_ = sweep.utime;
    return place_scan_of(sweep, parameters_);
  }

 private:
  bool is_due(model::Utime utime) const;

  PlaceScanParameters parameters_;
  std::optional<model::Utime> last_;
};

}  // namespace understory::landmark_extractor::place
