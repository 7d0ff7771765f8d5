// The cloud of a sweep for loop detectors, levelled and down-sampled.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/model/place_scan.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory::landmark_extractor::place {

/// Per cube with edges of `cube_m` the point nearest to its centre, of the points within `range_m`
/// in the plan; beyond `most` every n-th, in order of cubes. Points that are not finite are
/// dropped. O(n log n).
std::vector<model::PlacePoint> down_sampled(const std::vector<Eigen::Vector3f>& points,
                                            const PlaceScanParameters& parameters);

/// The cloud of a de-skewed sweep in `vehicle_level`; one without attitude is taken as level.
model::PlaceScan place_scan_of(const model::PointSweep& sweep,
                               const PlaceScanParameters& parameters);
/// Likewise of a scan in one plane.
model::PlaceScan place_scan_of(const model::PlanarScan& scan,
                               const PlaceScanParameters& parameters);

/// Selects the sweeps that become a PLACE_SCAN. State: time of the last one; a restart clears it.
class PlaceScans {
 public:
  /// `parameters`: none are made if the period is 0.
  explicit PlaceScans(const PlaceScanParameters& parameters) : parameters_(parameters) {}

  /// The cloud of a sweep or scan that is due: the first one, one `period_s` after the last, and
  /// one earlier than the last. Precondition: the extractor did not count it as malformed.
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
