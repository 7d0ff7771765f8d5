// Range of view of a sweep at the height of trunks, in all directions.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "common/model/view_ranges.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_cloud.hpp"

namespace understory::landmark_extractor::view {

/// Beams at heights where every trunk must be visible (knee height to above a person's) give the
/// range of view there. A beam's height above ground is interpolated linearly in range between the
/// sensor's and its return's: exact over plane ground. A beam without a return is ignored. Reuses
/// memory between sweeps, but has no state. Call begin(), take_ring() for each ring, finish().
class ViewProfile {
 public:
  /// Begins a sweep. `levelling.max_range_m`: range limit of its rings.
  void begin(const points::Levelling& levelling, const ground::GroundSurface& ground,
             const SweepParameters& parameters);
  /// Adds one sorted ring, while its points are in the cache.
  void take_ring(const rings::RingCloud& cloud, std::size_t ring);
  /// Ranges from all rings and from points beyond their range; no bins if no ring has a measured
  /// step.
  const model::ViewRanges& finish(const model::PointSweep& sweep, const rings::RingCloud& cloud,
                                  const points::Levelling& levelling,
                                  const ground::GroundSurface& ground);

 private:
  /// A sector of bearings during accumulation [m].
  struct Sector {
    float seen_m = 0.0F;      ///< Range that a beam reached between the heights.
    float nearest_m = 0.0F;   ///< Of the returns between them; 0 = none.
    float farthest_m = 0.0F;  ///< Likewise.
  };
  /// The bin of a bearing.
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
  float range_m_ = 0.0F;    ///< Ranges beyond this are set to it.
  std::vector<Sector> sectors_;
  std::vector<float> far_ground_m_;  ///< Per bin at `range_m_`, frame `vehicle_level`.
  std::vector<float> steps_;
  model::ViewRanges ranges_;
};

}  // namespace understory::landmark_extractor::view
