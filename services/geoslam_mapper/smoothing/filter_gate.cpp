#include "services/geoslam_mapper/smoothing/filter_gate.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// More associations than this cannot all be of one pedestrian.
constexpr std::size_t kFewLandmarks = 2;
/// Beyond this time the filter's drift is too large.
constexpr model::Utime kFilterGate_us = 3'000'000;

}  // namespace

bool contradicts_filter(const model::Keyframe& keyframe, const Placement& placement,
                        const FilterTrack& filter, const GlobalMap& map, double limit_m) {
  if (limit_m <= 0.0 || placement.associations.size() > kFewLandmarks) return false;
  const auto differs = [&](model::Utime from, model::Utime to, const geometry::SE2& motion) {
    const std::optional<geometry::SE2> filtered = filter.between(from, to);
    return filtered && (filtered->inverse() * motion).translation().norm() > limit_m;
  };

  // Motion within the keyframe.
  const model::KeyframeMember& first = keyframe.members.front();
  const model::KeyframeMember& last = keyframe.members.back();
  if (differs(first.utime, last.utime, first.centre_T_vehicle.inverse() * last.centre_T_vehicle))
    return true;

  // Motion since the last accepted keyframe.
  if (map.trajectory.bases().empty()) return false;
  const Base& base = map.trajectory.last();
  if (base.utime + kFilterGate_us < keyframe.utime) return false;
  const geometry::SE2 map_T_base = placement.map_T_centre.mean * keyframe.centre_T_base();
  return differs(base.utime, keyframe.utime,
                 map.trajectory.pose(base, map.graph).inverse() * map_T_base);
}

}  // namespace understory::geoslam_mapper::smoothing
