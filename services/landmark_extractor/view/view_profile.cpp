#include "services/landmark_extractor/view/view_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "services/landmark_extractor/view/range_bytes.hpp"

namespace understory::landmark_extractor::view {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// Sectors all around: 0.5 degrees each.
constexpr int kBins = 720;
/// Above this height a trunk must be visible unless it is occluded [m].
constexpr double kFoot_m = 0.5;
/// A beam must exceed the last return by this to have passed it [m].
constexpr float kPassed_m = 0.5F;
/// Beyond the range of any sensor [m].
constexpr float kFarthest_m = 1e4F;

/// Median of the rings' measured steps; 0 if there are none.
float beam_step(const rings::RingCloud& cloud, std::vector<float>& steps) {
  steps.clear();
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring)
    if (cloud.step_rad(ring) > 0.0F) steps.push_back(cloud.step_rad(ring));
  if (steps.empty()) return 0.0F;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Azimuth of the end of the revolution [rad], from one of its points; 0 if times are unknown.
float last_azimuth(const rings::RingCloud& cloud, const points::RingPoint& point) {
  if (cloud.spin_radps() == 0.0F) return 0.0F;
  return points::wrap_angle_f(point.azimuth_rad - cloud.spin_radps() * point.time_s);
}

}  // namespace

void ViewProfile::begin(const points::Levelling& levelling, const ground::GroundSurface& ground,
                        const SweepParameters& parameters) {
  const Eigen::Vector3f& sensor = levelling.sensor_m;
  lowest_m_ = static_cast<float>(kFoot_m);
  highest_m_ = static_cast<float>(parameters.standing_height_m);
  sensor_m_ =
      sensor.z() - static_cast<float>(ground.below(sensor.head<2>().cast<double>()).height_m);
  range_m_ = levelling.max_range_m;
  bins_ = {};
}

/// Distance that a beam with this return travelled between the heights: up to its exit [m].
inline float ViewProfile::way_in_band(float range_m, float height_m) const {
  if (height_m > highest_m_) {
    if (sensor_m_ >= highest_m_) return 0.0F;
    return range_m * (highest_m_ - sensor_m_) / (height_m - sensor_m_);
  }
  if (height_m >= lowest_m_) return range_m;
  if (sensor_m_ <= lowest_m_) return 0.0F;
  return range_m * (sensor_m_ - lowest_m_) / (sensor_m_ - height_m);
}

void ViewProfile::take_ring(const rings::RingCloud& cloud, std::size_t ring) {
  const std::size_t begin = cloud.ring_begin(ring);
  const std::size_t end = cloud.ring_end(ring);
  if (begin == end) return;
  if (bins_.count == 0) lay_bins(cloud, cloud.points()[begin]);

  for (const points::RingPoint& point : cloud.points().subspan(begin, end - begin)) {
    Sector& sector = sectors_[static_cast<std::size_t>(bins_.of(point.azimuth_rad))];
    sector.seen_m = std::max(sector.seen_m, way_in_band(point.range_m, point.height_m));
    if (point.height_m < lowest_m_ || point.height_m > highest_m_) continue;
    sector.farthest_m = std::max(sector.farthest_m, point.range_m);
    if (sector.nearest_m == 0.0F || point.range_m < sector.nearest_m)
      sector.nearest_m = point.range_m;
  }
}

const model::ViewRanges& ViewProfile::finish(const model::PointSweep& sweep,
                                             const rings::RingCloud& cloud,
                                             const points::Levelling& levelling,
                                             const ground::GroundSurface& ground) {
  ranges_ = {};
  ranges_.utime = sweep.utime;
  ranges_.sequence = sweep.sequence;
  const float step = beam_step(cloud, steps_);
  if (bins_.count == 0 || step == 0.0F) return ranges_;
  describe_bins(cloud);
  ranges_.beam_step_rad = step;
  find_far_ground(levelling, ground);
  take_far(cloud, levelling);
  write();
  return ranges_;
}

/// In order of time, if times are known.
void ViewProfile::lay_bins(const rings::RingCloud& cloud, const points::RingPoint& point) {
  const double direction = cloud.spin_radps() < 0.0F ? -1.0 : 1.0;
  bins_ = {last_azimuth(cloud, point), static_cast<float>(direction / kTurn), kBins};
  sectors_.assign(kBins, {});
}

void ViewProfile::describe_bins(const rings::RingCloud& cloud) {
  const float spin = cloud.spin_radps();
  ranges_.sensor_m = cloud.sensor_m().head<2>().cast<double>();
  if (spin != 0.0F)
    ranges_.turn_m = cloud.level_velocity_mps().head<2>().cast<double>() *
                     (kTurn / std::abs(static_cast<double>(spin)));
  ranges_.first_bearing_rad = bins_.first_rad;
  ranges_.step_rad = (spin < 0.0F ? -kTurn : kTurn) / kBins;
  ranges_.range_step_m = step_for(static_cast<double>(range_m_));
}

/// The ground below the beams at the range limit.
void ViewProfile::find_far_ground(const points::Levelling& levelling,
                                  const ground::GroundSurface& ground) {
  constexpr std::size_t kLanes = 8;
  static_assert(kBins % kLanes == 0);
  std::vector<float>& heights = far_ground_m_;
  heights.assign(kBins, 0.0F);
  std::array<float, kBins> x{};
  std::array<float, kBins> y{};
  const std::array<float, kBins> z{};
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const float turns = (static_cast<float>(bin) + 0.5F) / kBins;
    const float azimuth = bins_.first_rad + turns / bins_.turns_per_rad;
    x[bin] = levelling.sensor_m.x() + range_m_ * std::cos(azimuth);
    y[bin] = levelling.sensor_m.y() + range_m_ * std::sin(azimuth);
  }
  points::heights_above(x.data(), y.data(), z.data(), kBins, ground.grid(), ground.patches(),
                        heights.data());
  for (float& height : heights) height = -height;
}

/// Returns beyond the range, which are not in the rings: free distance of their beams.
void ViewProfile::take_far(const rings::RingCloud& cloud, const points::Levelling& levelling) {
  const float sensor = levelling.sensor_m.z();
  const float climb = levelling.velocity_mps.z();
  for (const points::RingPoint& point : cloud.far_points()) {
    if (!(point.range_m < kFarthest_m)) continue;
    const int bin = bins_.of(point.azimuth_rad);
    const float rise = point.z_m - sensor - point.time_s * climb;
    const float height =
        sensor + range_m_ * rise / point.range_m - far_ground_m_[static_cast<std::size_t>(bin)];
    Sector& sector = sectors_[static_cast<std::size_t>(bin)];
    sector.seen_m = std::max(sector.seen_m, way_in_band(range_m_, height));
  }
}

void ViewProfile::write() {
  const double step = ranges_.range_step_m;
  ranges_.free.reserve(sectors_.size());
  ranges_.hidden.reserve(sectors_.size());
  for (const Sector& sector : sectors_) {
    const bool is_stopped = sector.nearest_m > 0.0F;
    const bool is_hidden = is_stopped && sector.seen_m < sector.farthest_m + kPassed_m;
    ranges_.free.push_back(rounded_down(is_stopped ? sector.nearest_m : sector.seen_m, step));
    ranges_.hidden.push_back(is_hidden ? rounded_up(sector.farthest_m, step) : 0);
  }
}

}  // namespace understory::landmark_extractor::view
