#include "services/geoslam_mapper/lines_of_sight.hpp"

#include <algorithm>
#include <vector>

namespace understory::geoslam_mapper {
namespace {

/// A scan of the keyframe with its ranges.
struct RangedScan {
  const model::ViewRanges* ranges = nullptr;
  geometry::SE2 vehicle_T_map;
};

model::LineOfSight common_sight(std::span<const RangedScan> scans,
                                const model::MapLandmark& landmark) {
  std::size_t blocked = 0;
  std::size_t clear = 0;
  for (const RangedScan& scan : scans) {
    const model::LineOfSight sight =
        line_of_sight(*scan.ranges, scan.vehicle_T_map * landmark.position_m, landmark.radius_m);
    blocked += sight == model::LineOfSight::kBlocked ? 1 : 0;
    clear += sight == model::LineOfSight::kClear ? 1 : 0;
  }
  if (clear == 0 && 2 * blocked >= scans.size()) return model::LineOfSight::kBlocked;
  if (blocked == 0 && 2 * clear >= scans.size()) return model::LineOfSight::kClear;
  return model::LineOfSight::kUnknown;
}

}  // namespace

void LinesOfSight::add(const model::ViewRanges& ranges) {
  ranges_.push_back(ranges);
  if (ranges_.size() > kKept) ranges_.pop_front();
}

void LinesOfSight::fill(const model::Keyframe& keyframe,
                        std::span<const model::MapLandmark> landmarks,
                        model::MapUpdate& update) const {
  if (update.expected.empty()) return;
  std::vector<RangedScan> scans;
  const geometry::SE2 map_T_centre = update.map_T_vehicle * keyframe.centre_T_base().inverse();
  for (const model::KeyframeMember& member : keyframe.members) {
    const auto found = std::ranges::find(ranges_, member.utime, &model::ViewRanges::utime);
    if (found == ranges_.end()) continue;
    scans.push_back({&*found, (map_T_centre * member.centre_T_vehicle).inverse()});
  }
  if (scans.empty()) return;

  for (model::ExpectedLandmark& one : update.expected) {
    const auto landmark = std::ranges::lower_bound(landmarks, one.id, {}, &model::MapLandmark::id);
    if (landmark == landmarks.end() || landmark->id != one.id) continue;
    one.sight = common_sight(scans, *landmark);
  }
}

}  // namespace understory::geoslam_mapper
