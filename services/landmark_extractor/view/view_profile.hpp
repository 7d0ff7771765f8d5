// How far a sweep saw at the height of trunks, all around.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/planar_scan.hpp"
#include "common/model/view_ranges.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_cloud.hpp"

namespace understory::landmark_extractor::view {

/// Beams at heights where every trunk must be (knee height to above a person's) say how far one can
/// see there. A beam is followed at the height above ground that lies between the sensor's and its
/// return's in proportion to the range: exact over ground that is a plane from here to there. A
/// beam without a return says nothing. Keeps its memory from sweep to sweep, but no state.
class ViewProfile {
 public:
  /// Ranges of a sweep whose rings are in order; no bins where it has no rings to measure by.
  /// `range_m`: as far as `cloud` goes.
  const model::ViewRanges& measure(const model::PointSweep& sweep, const rings::RingCloud& cloud,
                                   const points::Levelling& levelling,
                                   const ground::GroundSurface& ground,
                                   const SweepParameters& parameters, double range_m);

 private:
  /// A sector of bearings while returns come in [m].
  struct Sector {
    float seen_m = 0.0F;      ///< As far as a beam came between the heights.
    float nearest_m = 0.0F;   ///< Of the returns between them; 0 = none.
    float farthest_m = 0.0F;  ///< Likewise.
  };
  /// Which bin a bearing is in.
  struct Bins {
    float first_rad = 0.0F;
    float turns_per_rad = 0.0F;  ///< Negative = to the right.
    int count = 0;

    int of(float azimuth_rad) const {
      const float turns = (azimuth_rad - first_rad) * turns_per_rad;
      const float within =
          turns - static_cast<float>(static_cast<int>(turns) - (turns < 0.0F ? 1 : 0));
      const int bin = static_cast<int>(within * static_cast<float>(count));
      return bin < count ? bin : 0;
    }
  };

  void lay_bins(const model::PointSweep& sweep, const rings::RingCloud& cloud);
  void take_rings(const rings::RingCloud& cloud);
  void take_far(const model::PointSweep& sweep, const points::Levelling& levelling);
  void find_far_ground(const points::Levelling& levelling, const ground::GroundSurface& ground);
  float way_in_band(float range_m, float height_m) const;
  void write();

  Bins bins_;
  float lowest_m_ = 0.0F;   ///< Above ground.
  float highest_m_ = 0.0F;  ///< Likewise.
  float sensor_m_ = 0.0F;   ///< Likewise.
  float range_m_ = 0.0F;    ///< What is farther counts as that far.
  std::vector<Sector> sectors_;
  std::vector<float> far_ground_m_;  ///< Of each bin at `range_m_`, frame `vehicle_level`.
  std::vector<float> steps_;
  model::ViewRanges ranges_;
};

/// The same of a laser that scans one plane: a bin for each beam, up to `range_m` and a little
/// more.
model::ViewRanges planar_view(const model::PlanarScan& scan, double range_m);

}  // namespace understory::landmark_extractor::view
