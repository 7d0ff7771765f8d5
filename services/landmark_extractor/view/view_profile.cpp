#include "services/landmark_extractor/view/view_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace understory::landmark_extractor::view {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// Sectors all around: 0.5 degrees each.
constexpr int kBins = 720;
/// Of the unit of ranges, as one byte has.
constexpr double kMostSteps = 255.0;
/// From here upwards a trunk must be seen where nothing hides it [m].
constexpr double kFoot_m = 0.5;
/// Beams that went so little farther than the last return did not pass it [m].
constexpr float kPassed_m = 0.5F;
/// No sensor looks so far [m].
constexpr float kFarthest_m = 1e4F;

/// Never farther than it is.
std::uint8_t rounded_down(double range_m, double step_m) {
  return static_cast<std::uint8_t>(std::min(kMostSteps, std::floor(range_m / step_m)));
}

/// Never nearer than it is; 0 where it does not fit into a byte.
std::uint8_t rounded_up(double range_m, double step_m) {
  const double steps = std::max(1.0, std::ceil(range_m / step_m));
  return steps > kMostSteps ? 0 : static_cast<std::uint8_t>(steps);
}

/// Median of what the rings measured; 0 where none did.
float beam_step(const rings::RingCloud& cloud, std::vector<float>& steps) {
  steps.clear();
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring)
    if (cloud.step_rad(ring) > 0.0F) steps.push_back(cloud.step_rad(ring));
  if (steps.empty()) return 0.0F;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Where the revolution ended [rad]; 0 where times are not known.
float last_azimuth(const rings::RingCloud& cloud) {
  if (cloud.spin_radps() == 0.0F) return 0.0F;
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    if (cloud.ring_begin(ring) == cloud.ring_end(ring)) continue;
    const points::RingPoint& point = cloud.points()[cloud.ring_begin(ring)];
    return points::wrap_angle_f(point.azimuth_rad - cloud.spin_radps() * point.time_s);
  }
  return 0.0F;
}

}  // namespace

const model::ViewRanges& ViewProfile::measure(const model::PointSweep& sweep,
                                              const rings::RingCloud& cloud,
                                              const points::Levelling& levelling,
                                              const ground::GroundSurface& ground,
                                              const SweepParameters& parameters, double range_m) {
  lay_bins(sweep, cloud);
  if (bins_.count == 0) return ranges_;
  const Eigen::Vector3f& sensor = levelling.sensor_m;
  lowest_m_ = static_cast<float>(kFoot_m);
  highest_m_ = static_cast<float>(parameters.standing_height_m);
  sensor_m_ =
      sensor.z() - static_cast<float>(ground.below(sensor.head<2>().cast<double>()).height_m);
  range_m_ = static_cast<float>(range_m);
  ranges_.range_step_m = range_m / (kMostSteps - 1.0);

  sectors_.assign(static_cast<std::size_t>(bins_.count), {});
  take_rings(cloud);
  find_far_ground(levelling, ground);
  take_far(sweep, levelling);
  write();
  return ranges_;
}

/// In order of time, where times are known.
void ViewProfile::lay_bins(const model::PointSweep& sweep, const rings::RingCloud& cloud) {
  ranges_ = {};
  ranges_.utime = sweep.utime;
  ranges_.sequence = sweep.sequence;
  bins_ = {};
  const float step = beam_step(cloud, steps_);
  if (step == 0.0F) return;
  const float spin = cloud.spin_radps();
  const double direction = spin < 0.0F ? -1.0 : 1.0;
  bins_ = {last_azimuth(cloud), static_cast<float>(direction / kTurn), kBins};
  ranges_.sensor_m = cloud.sensor_m().head<2>().cast<double>();
  if (spin != 0.0F)
    ranges_.turn_m = cloud.level_velocity_mps().head<2>().cast<double>() *
                     (kTurn / std::abs(static_cast<double>(spin)));
  ranges_.first_bearing_rad = bins_.first_rad;
  ranges_.step_rad = direction * kTurn / kBins;
  ranges_.beam_step_rad = step;
}

/// How far a beam with this return was between the heights: from where it leaves them [m].
float ViewProfile::way_in_band(float range_m, float height_m) const {
  if (height_m > highest_m_) {
    if (sensor_m_ >= highest_m_) return 0.0F;
    return range_m * (highest_m_ - sensor_m_) / (height_m - sensor_m_);
  }
  if (height_m >= lowest_m_) return range_m;
  if (sensor_m_ <= lowest_m_) return 0.0F;
  return range_m * (sensor_m_ - lowest_m_) / (sensor_m_ - height_m);
}

void ViewProfile::take_rings(const rings::RingCloud& cloud) {
  const std::span points = cloud.points();
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    for (std::size_t i = cloud.ring_begin(ring); i < cloud.ring_end(ring); ++i) {
      const points::RingPoint& point = points[i];
      Sector& sector = sectors_[static_cast<std::size_t>(bins_.of(point.azimuth_rad))];
      sector.seen_m = std::max(sector.seen_m, way_in_band(point.range_m, point.height_m));
      if (point.height_m < lowest_m_ || point.height_m > highest_m_) continue;
      sector.farthest_m = std::max(sector.farthest_m, point.range_m);
      if (sector.nearest_m == 0.0F || point.range_m < sector.nearest_m)
        sector.nearest_m = point.range_m;
    }
  }
}

/// The ground under where beams leave the range.
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

/// Returns beyond the range, which the rings do not have: how far their beams were free.
void ViewProfile::take_far(const model::PointSweep& sweep, const points::Levelling& levelling) {
  const Eigen::Vector3f& sensor = levelling.sensor_m;
  for (const model::SweepPoint& point : sweep.points) {
    const Eigen::Vector3f offset = levelling.level_R_vehicle * point.position() - sensor -
                                   point.time_s * levelling.velocity_mps;
    const float distance = offset.head<2>().norm();
    if (!(distance > range_m_ && distance < kFarthest_m)) continue;
    const int bin = bins_.of(points::fast_atan2(offset.y(), offset.x()));
    const float height = sensor.z() + range_m_ * offset.z() / distance -
                         far_ground_m_[static_cast<std::size_t>(bin)];
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

model::ViewRanges planar_view(const model::PlanarScan& scan, double range_m) {
  model::ViewRanges ranges;
  ranges.utime = scan.utime;
  ranges.sequence = scan.sequence;
  ranges.sensor_m = scan.vehicle_T_sensor.translation();
  ranges.first_bearing_rad = geometry::wrap_angle(
      scan.first_bearing_rad - 0.5 * scan.bearing_step_rad + scan.vehicle_T_sensor.theta());
  ranges.step_rad = scan.bearing_step_rad;
  ranges.beam_step_rad = std::abs(scan.bearing_step_rad);
  ranges.range_step_m = range_m / (kMostSteps - 1.0);
  // The first beam may come again as the last.
  const auto turn = static_cast<std::size_t>(kTurn / std::abs(scan.bearing_step_rad) + 1e-6);
  for (std::size_t beam = 0; beam < std::min(turn, scan.ranges_m.size()); ++beam) {
    const double beam_m = scan.is_return(beam) ? scan.ranges_m[beam] : 0.0;
    ranges.free.push_back(rounded_down(beam_m, ranges.range_step_m));
    ranges.hidden.push_back(beam_m > 0.0 ? rounded_up(beam_m, ranges.range_step_m) : 0);
  }
  return ranges;
}

}  // namespace understory::landmark_extractor::view
