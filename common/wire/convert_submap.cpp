#include <algorithm>
#include <span>

#include "common/wire/convert.hpp"
#include "common/wire/convert_map_parts.hpp"

namespace understory::wire {
namespace {

constexpr double kMostIds = 9.3e18;

/// Number of a map or of an item in it; `lowest`: 0 if it may be missing.
std::uint64_t number(std::string_view field, std::int64_t wire, Checks& checks,
                     double lowest = 1.0) {
  checks.range(field, static_cast<double>(wire), lowest, kMostIds);
  return static_cast<std::uint64_t>(wire);
}

std::uint32_t map_number(std::int32_t wire, Checks& checks) {
  checks.range("map_id", wire, 1.0, kMostMaps);
  return static_cast<std::uint32_t>(wire);
}

std::vector<model::SubmapId> submap_ids(std::string_view field,
                                        const std::vector<std::int64_t>& wire, Checks& checks) {
  std::vector<model::SubmapId> result;
  result.reserve(wire.size());
  for (const std::int64_t one : wire) result.push_back(number(field, one, checks));
  return result;
}

model::LoopEnd loop_end(const loop_end_t& wire, Checks& checks) {
  return {number("submap_id", wire.submap_id, checks, 0.0),
          number("keyframe_seq", wire.keyframe_seq, checks, 0.0)};
}

loop_end_t to_wire(const model::LoopEnd& end) {
  loop_end_t wire{};
  wire.submap_id = static_cast<std::int64_t>(end.submap);
  wire.keyframe_seq = static_cast<std::int64_t>(end.keyframe);
  return wire;
}

}  // namespace

Result<model::Submap> from_wire(const submap_t& wire) {
  Checks checks;
  model::Submap submap;
  take_stamp(wire, submap);
  submap.map_id = map_number(wire.map_id, checks);
  submap.id = number("submap_id", wire.submap_id, checks);
  submap.replaced = submap_ids("replaced", wire.replaced, checks);
  checks.pose("map_T_submap", wire.map_T_submap);
  submap.map_T_submap = from_wire(wire.map_T_submap);
  submap.landmarks = landmarks("landmarks", wire.landmarks, checks);
  submap.keyframes = keyframe_poses(wire.keyframes, checks);

  checks.in_message();
  submap.payload.assign(wire.payload.begin(), wire.payload.end());
  submap.content_hash = static_cast<std::uint64_t>(wire.content_hash);
  checks.consistent(model::fnv1a(submap.payload) == submap.content_hash,
                    "content_hash is the payload's");
  return checks.result(submap);
}

submap_t to_wire(const model::Submap& submap) {
  submap_t wire{};
  put_stamp(submap, wire);
  wire.map_id = static_cast<std::int32_t>(submap.map_id);
  wire.submap_id = static_cast<std::int64_t>(submap.id);
  wire.content_hash = static_cast<std::int64_t>(submap.content_hash);
  wire.map_T_submap = to_wire(submap.map_T_submap);
  wire.landmarks = to_wire(submap.landmarks);
  wire.num_landmarks = static_cast<std::int32_t>(wire.landmarks.size());
  wire.keyframes = to_wire(submap.keyframes);
  wire.num_keyframes = static_cast<std::int32_t>(wire.keyframes.size());
  wire.replaced.assign(submap.replaced.begin(), submap.replaced.end());
  wire.num_replaced = static_cast<std::int32_t>(wire.replaced.size());
  wire.payload.assign(submap.payload.begin(), submap.payload.end());
  wire.payload_bytes = static_cast<std::int32_t>(wire.payload.size());
  return wire;
}

Result<model::SubmapStored> from_wire(const submap_stored_t& wire) {
  Checks checks;
  model::SubmapStored stored;
  take_stamp(wire, stored);
  stored.map_id = map_number(wire.map_id, checks);
  stored.id = number("submap_id", wire.submap_id, checks);
  stored.content_hash = static_cast<std::uint64_t>(wire.content_hash);
  return checks.result(stored);
}

submap_stored_t to_wire(const model::SubmapStored& stored) {
  submap_stored_t wire{};
  put_stamp(stored, wire);
  wire.map_id = static_cast<std::int32_t>(stored.map_id);
  wire.submap_id = static_cast<std::int64_t>(stored.id);
  wire.content_hash = static_cast<std::int64_t>(stored.content_hash);
  return wire;
}

Result<model::SubmapQuery> from_wire(const submap_query_t& wire) {
  Checks checks;
  model::SubmapQuery query;
  take_stamp(wire, query);
  query.map_id = map_number(wire.map_id, checks);
  query.ids = submap_ids("submap_ids", wire.submap_ids, checks);
  return checks.result(query);
}

submap_query_t to_wire(const model::SubmapQuery& query) {
  submap_query_t wire{};
  put_stamp(query, wire);
  wire.map_id = static_cast<std::int32_t>(query.map_id);
  wire.submap_ids.assign(query.ids.begin(), query.ids.end());
  wire.num_submaps = static_cast<std::int32_t>(wire.submap_ids.size());
  return wire;
}

Result<model::MapCorrection> from_wire(const map_correction_t& wire) {
  Checks checks;
  model::MapCorrection correction;
  take_stamp(wire, correction);
  correction.map_id = map_number(wire.map_id, checks);
  correction.version = number("version", wire.version, checks);
  correction.submaps.reserve(wire.submaps.size());
  for (std::size_t i = 0; i < wire.submaps.size(); ++i) {
    checks.in("submaps", i);
    const submap_pose_t& one = wire.submaps[i];
    checks.pose("map_T_submap", one.map_T_submap);
    correction.submaps.push_back(
        {number("submap_id", one.submap_id, checks), from_wire(one.map_T_submap)});
    checks.consistent(i == 0 || correction.submaps[i - 1].id < correction.submaps[i].id,
                      "submaps are in order of submap_id");
  }
  return checks.result(correction);
}

map_correction_t to_wire(const model::MapCorrection& correction) {
  map_correction_t wire{};
  put_stamp(correction, wire);
  wire.map_id = static_cast<std::int32_t>(correction.map_id);
  wire.version = static_cast<std::int64_t>(correction.version);
  wire.submaps.reserve(correction.submaps.size());
  for (const model::SubmapPose& one : correction.submaps) {
    submap_pose_t& out = wire.submaps.emplace_back();
    out.submap_id = static_cast<std::int64_t>(one.id);
    out.map_T_submap = to_wire(one.map_T_submap);
  }
  wire.num_submaps = static_cast<std::int32_t>(wire.submaps.size());
  return wire;
}

Result<model::LoopClosure> from_wire(const loop_closure2_t& wire) {
  Checks checks;
  model::LoopClosure closure;
  take_stamp(wire, closure);
  closure.map_id = map_number(wire.map_id, checks);
  closure.id = number("closure_id", wire.closure_id, checks);
  closure.source = wire.source;
  closure.is_revoked = wire.revoked != 0;
  if (!closure.is_revoked) {
    closure.from = loop_end(wire.from_end, checks);
    closure.to = loop_end(wire.to_end, checks);
    checks.pose("from_T_to", wire.from_T_to);
    closure.from_T_to.mean = from_wire(wire.from_T_to);
    closure.from_T_to.covariance = checks.covariance("covariance", wire.covariance);
    checks.consistent(closure.from_T_to.covariance.diagonal().minCoeff() > 0.0,
                      "covariance is positive");
    checks.range("log10_false_alarm", wire.log10_false_alarm, -1e9, 0.0);
    closure.log10_false_alarm = wire.log10_false_alarm;
  }
  return checks.result(closure);
}

Result<model::LoopClosure> from_wire(const loop_closure_t& wire) {
  loop_closure2_t same{};
  same.utime = wire.utime;
  same.seq = wire.seq;
  same.map_id = wire.map_id;
  same.closure_id = wire.closure_id;
  same.source = wire.source;
  same.revoked = wire.revoked;
  same.from_end = wire.from;
  same.to_end = wire.to;
  same.from_T_to = wire.from_T_to;
  std::ranges::copy(std::span(&wire.covariance[0][0], 9), &same.covariance[0][0]);
  same.log10_false_alarm = wire.log10_false_alarm;
  return from_wire(same);
}

loop_closure2_t to_wire(const model::LoopClosure& closure) {
  loop_closure2_t wire{};
  put_stamp(closure, wire);
  wire.map_id = static_cast<std::int32_t>(closure.map_id);
  wire.closure_id = static_cast<std::int64_t>(closure.id);
  wire.source = closure.source;
  wire.revoked = closure.is_revoked ? 1 : 0;
  wire.from_end = to_wire(closure.from);
  wire.to_end = to_wire(closure.to);
  wire.from_T_to = to_wire(closure.from_T_to.mean);
  copy_matrix(closure.from_T_to.covariance, wire.covariance);
  wire.log10_false_alarm = closure.log10_false_alarm;
  return wire;
}

Result<model::LoopResult> from_wire(const loop_result_t& wire) {
  Checks checks;
  model::LoopResult result;
  take_stamp(wire, result);
  result.map_id = map_number(wire.map_id, checks);
  result.closure_id = number("closure_id", wire.closure_id, checks);
  checks.range("status", wire.status, loop_result_t::ACCEPTED, loop_result_t::REVOKED);
  result.status = static_cast<model::LoopResult::Status>(wire.status);
  result.reason = wire.reason;
  return checks.result(result);
}

loop_result_t to_wire(const model::LoopResult& result) {
  loop_result_t wire{};
  put_stamp(result, wire);
  wire.map_id = static_cast<std::int32_t>(result.map_id);
  wire.closure_id = static_cast<std::int64_t>(result.closure_id);
  wire.status = static_cast<std::int8_t>(result.status);
  wire.reason = result.reason;
  return wire;
}

}  // namespace understory::wire
