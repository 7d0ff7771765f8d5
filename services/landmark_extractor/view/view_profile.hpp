// How far a sweep saw at the height of trunks, all around.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "common/model/view_ranges.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_cloud.hpp"

namespace understory::landmark_extractor::view {

/// Beams at heights where every trunk must be (knee height to above a person's) say how far one can
/// see there. A beam is followed at the height above ground that lies between the sensor's and its
/// return's in proportion to the range: exact over ground that is a plane from here to there. A
/// beam without a return says nothing. Keeps its memory from sweep to sweep, but no state. Call
/// begin(), take_ring() for each ring, finish().
class ViewProfile {
 public:
  /// A sweep. `levelling.max_range_m`: as far as its rings go.
  void begin(const points::Levelling& levelling, const ground::GroundSurface& ground,
             const SweepParameters& parameters);
  /// One ring of it that is in order: while its points are in the cache.
  void take_ring(const rings::RingCloud& cloud, std::size_t ring);
  /// Ranges by all rings, and by what is farther; no bins where the sweep has no rings to measure
  /// by.
  const model::ViewRanges& finish(const model::PointSweep& sweep, const rings::RingCloud& cloud,
                                  const points::Levelling& levelling,
                                  const ground::GroundSurface& ground);

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

  void lay_bins(const rings::RingCloud& cloud, const points::RingPoint& point);
  void describe_bins(const rings::RingCloud& cloud);
  void take_far(const rings::RingCloud& cloud, const points::Levelling& levelling);
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

}  // namespace understory::landmark_extractor::view
