#include "common/wire/convert.hpp"
#include "common/wire/convert_ids.hpp"
#include "common/wire/convert_map_parts.hpp"

namespace understory::wire {
Result<model::WholeMap> from_wire(const map_t& wire) {
  Checks checks;
  checks.range("version", static_cast<double>(wire.version), 0.0, 9.3e18);
  model::WholeMap map;
  take_stamp(wire, map);
  map.version = static_cast<std::uint64_t>(wire.version);
  map.complete = wire.complete != 0;
  map.landmarks = landmarks("landmarks", wire.landmarks, checks);
  map.keyframes = keyframe_poses(wire.keyframes, checks);
  return checks.result(map);
}

map_t to_wire(const model::WholeMap& map) {
  map_t wire{};
  put_stamp(map, wire);
  wire.version = static_cast<std::int64_t>(map.version);
  wire.complete = map.complete ? 1 : 0;
  wire.landmarks = to_wire(map.landmarks);
  wire.num_landmarks = static_cast<std::int32_t>(wire.landmarks.size());
  wire.keyframes = to_wire(map.keyframes);
  wire.num_keyframes = static_cast<std::int32_t>(wire.keyframes.size());
  return wire;
}

Result<model::MapDelta> from_wire(const map_delta_t& wire) {
  Checks checks;
  checks.consistent(wire.base_version >= 0 && wire.base_version < wire.version,
                    "base_version < version");
  model::MapDelta delta;
  take_stamp(wire, delta);
  delta.base_version = static_cast<std::uint64_t>(wire.base_version);
  delta.version = static_cast<std::uint64_t>(wire.version);
  delta.added = landmarks("added", wire.added, checks);
  delta.moved = landmarks("moved", wire.moved, checks);
  delta.removed = ids("removed", wire.removed, checks);
  delta.merged = merges(wire.merged, checks);
  return checks.result(delta);
}

map_delta_t to_wire(const model::MapDelta& delta) {
  map_delta_t wire{};
  put_stamp(delta, wire);
  wire.base_version = static_cast<std::int64_t>(delta.base_version);
  wire.version = static_cast<std::int64_t>(delta.version);
  wire.added = to_wire(delta.added);
  wire.moved = to_wire(delta.moved);
  wire.removed.assign(delta.removed.begin(), delta.removed.end());
  wire.merged = to_wire(delta.merged);
  copy_counts(wire);
  wire.num_moved = static_cast<std::int32_t>(wire.moved.size());
  return wire;
}

}  // namespace understory::wire
