#include "common/place_recognition/level_stems.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::place_recognition {
namespace {

constexpr double kPerMetre = 200.0;
constexpr double kFarthestM = 160.0;
constexpr double kDiameterPerMetre = 1000.0;
constexpr double kThickestM = 60.0;
/// The extent is the distance that nine in ten stems do not exceed, times this factor.
constexpr double kBeyond = 1.05;

}  // namespace

PackedStems::PackedStems(std::span<const LevelStem> stems) {
  stems_.reserve(stems.size());
  for (const LevelStem& stem : stems) {
    // Written so that NaN fails.
    if (!(stem.position_m.cwiseAbs().maxCoeff() <= kFarthestM)) continue;
    if (!(stem.position_m.cwiseAbs().sum() <= 2.0 * kFarthestM)) continue;
    const double diameter = stem.diameter_m > 0.0 ? std::min(stem.diameter_m, kThickestM) : 0.0;
    stems_.push_back({static_cast<std::int16_t>(std::lround(kPerMetre * stem.position_m.x())),
                      static_cast<std::int16_t>(std::lround(kPerMetre * stem.position_m.y())),
                      static_cast<std::uint16_t>(std::lround(kDiameterPerMetre * diameter))});
  }
}

std::vector<LevelStem> PackedStems::unpacked() const {
  std::vector<LevelStem> stems;
  stems.reserve(stems_.size());
  for (const Packed& stem : stems_)
    stems.push_back({{stem.x / kPerMetre, stem.y / kPerMetre}, stem.diameter / kDiameterPerMetre});
  return stems;
}

StemExtent extent_of(std::span<const LevelStem> stems) {
  StemExtent extent;
  if (stems.empty()) return extent;
  std::vector<double> ranges;
  ranges.reserve(stems.size());
  for (const LevelStem& stem : stems) ranges.push_back(stem.position_m.norm());
  const auto at = ranges.begin() + static_cast<std::ptrdiff_t>(9 * (ranges.size() - 1) / 10);
  std::nth_element(ranges.begin(), at, ranges.end());

  extent.radius_m = std::max(1.0, kBeyond * *at);
  const auto inside = static_cast<double>(
      std::ranges::count_if(ranges, [&](double range) { return range <= extent.radius_m; }));
  extent.density_per_m2 = inside / (std::numbers::pi * extent.radius_m * extent.radius_m);
  return extent;
}

}  // namespace understory::place_recognition
