#include "common/model/view_ranges.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::model {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// A return this close behind the surface may be the landmark itself [m].
constexpr double kBehind_m = 0.5;
/// Nearer than this the bins are too coarse [m].
constexpr double kNear_m = 0.3;
/// Possible error of the landmark's position [m].
constexpr double kBeside_m = 0.15;
/// Radius assumed for an unknown radius [m].
constexpr double kThin_m = 0.05;
/// A trunk at least this many beams wide stops at least one beam.
constexpr double kSureBeams = 2.0;

/// Bins from the first one to a bearing, as a fraction.
double bins_to(const ViewRanges& ranges, double bearing_rad) {
  const double turned = (bearing_rad - ranges.first_bearing_rad) / ranges.step_rad;
  const double all = kTurn / std::abs(ranges.step_rad);
  return turned - all * std::floor(turned / all);
}

/// The index of a bin wrapped into the turn; none in a gap.
std::ptrdiff_t bin_of(const ViewRanges& ranges, std::ptrdiff_t index) {
  const auto all = static_cast<std::ptrdiff_t>(std::lround(kTurn / std::abs(ranges.step_rad)));
  const std::ptrdiff_t bin = ((index % all) + all) % all;
  return bin < static_cast<std::ptrdiff_t>(ranges.free.size()) ? bin : -1;
}

double bearing_of(const Eigen::Vector2d& offset_m) {
  return std::atan2(offset_m.y(), offset_m.x());
}

/// Offset from the sensor's position when it measured that direction.
Eigen::Vector2d offset_of(const ViewRanges& ranges, const Eigen::Vector2d& place_m) {
  Eigen::Vector2d offset_m = place_m - ranges.sensor_m;
  for (int round = 0; round < 2; ++round) {
    const auto index = static_cast<std::ptrdiff_t>(bins_to(ranges, bearing_of(offset_m)));
    const std::ptrdiff_t bin = bin_of(ranges, index);
    if (bin >= 0) offset_m = place_m - ranges.sensor_at(static_cast<std::size_t>(bin));
  }
  return offset_m;
}

}  // namespace

LineOfSight line_of_sight(const ViewRanges& ranges, const Eigen::Vector2d& place_m,
                          double radius_m) {
  if (ranges.free.empty() || ranges.step_rad == 0.0) return LineOfSight::kUnknown;
  if (radius_m <= 0.0) radius_m = kThin_m;
  const Eigen::Vector2d offset_m = offset_of(ranges, place_m);
  const double distance_m = offset_m.norm();
  if (distance_m - radius_m <= kNear_m) return LineOfSight::kUnknown;
  const double beyond_m = distance_m + radius_m + kBehind_m;

  // Bins over the landmark's width.
  const double half =
      std::asin(std::min(1.0, (radius_m + kBeside_m) / distance_m)) / std::abs(ranges.step_rad);
  const double middle = bins_to(ranges, bearing_of(offset_m));
  std::size_t known = 0;
  std::size_t clear = 0;
  std::size_t blocked = 0;
  for (auto i = static_cast<std::ptrdiff_t>(std::floor(middle - half));
       i <= static_cast<std::ptrdiff_t>(std::floor(middle + half)); ++i) {
    const std::ptrdiff_t bin = bin_of(ranges, i);
    if (bin < 0) return LineOfSight::kUnknown;
    const double free_m = ranges.range_step_m * ranges.free[static_cast<std::size_t>(bin)];
    const double hidden_m = ranges.range_step_m * ranges.hidden[static_cast<std::size_t>(bin)];
    if (free_m == 0.0 && hidden_m == 0.0) continue;
    ++known;
    clear += free_m > beyond_m ? 1 : 0;
    blocked += hidden_m > 0.0 && hidden_m < beyond_m ? 1 : 0;
  }

  if (known == 0) return LineOfSight::kUnknown;
  if (2 * blocked >= known) return LineOfSight::kBlocked;
  const double beams = 2.0 * radius_m / (distance_m * ranges.beam_step_rad);
  return clear == known && beams >= kSureBeams ? LineOfSight::kClear : LineOfSight::kUnknown;
}

}  // namespace understory::model
