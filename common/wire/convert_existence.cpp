#include "common/model/submap.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/convert_ids.hpp"
#include "common/wire/convert_map_parts.hpp"

namespace understory::wire {
namespace {

std::vector<model::LandmarkExistence> existences(const std::vector<landmark_existence_t>& wire,
                                                 Checks& checks) {
  std::vector<model::LandmarkExistence> result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    checks.in("landmarks", i);
    checks.range("probability", wire[i].probability, 0.0, 1.0);
    result.push_back(
        {landmark_id(wire[i].landmark_id, checks), wire[i].probability, wire[i].in_use != 0});
    checks.consistent(i == 0 || result[i - 1].id < result[i].id,
                      "landmarks are in order of landmark_id");
  }
  checks.in_message();
  return result;
}

std::vector<landmark_existence_t> to_wire(const std::vector<model::LandmarkExistence>& landmarks) {
  std::vector<landmark_existence_t> result(landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    result[i].landmark_id = static_cast<std::int64_t>(landmarks[i].id);
    result[i].probability = landmarks[i].probability;
    result[i].in_use = landmarks[i].is_in_use ? 1 : 0;
  }
  return result;
}

std::uint32_t existence_map_id(std::int32_t wire, Checks& checks) {
  checks.range("map_id", wire, 1.0, kMostMaps);
  return static_cast<std::uint32_t>(wire);
}

std::uint64_t existence_hash(const model::ExistenceState& state) {
  return model::fnv1a(state.model + state.states);
}

}  // namespace

Result<model::Existence> from_wire(const existence_t& wire) {
  Checks checks;
  model::Existence existence;
  take_stamp(wire, existence);
  existence.map_id = existence_map_id(wire.map_id, checks);
  existence.is_whole = wire.whole != 0;
  existence.landmarks = existences(wire.landmarks, checks);
  checks.range("num_known", wire.num_known, 0.0, 2147483647.0);
  checks.range("num_unused", wire.num_unused, 0.0, static_cast<double>(wire.num_known));
  existence.known = static_cast<std::uint32_t>(wire.num_known);
  existence.unused = static_cast<std::uint32_t>(wire.num_unused);
  checks.range("missing_share", wire.missing_share, 0.0, 1.0);
  checks.range("new_share", wire.new_share, 0.0, 1.0);
  existence.missing_share = wire.missing_share;
  existence.new_share = wire.new_share;
  existence.is_mapping_needed = wire.mapping_needed != 0;
  return checks.result(existence);
}

existence_t to_wire(const model::Existence& existence) {
  existence_t wire{};
  put_stamp(existence, wire);
  wire.map_id = static_cast<std::int32_t>(existence.map_id);
  wire.whole = existence.is_whole ? 1 : 0;
  wire.landmarks = to_wire(existence.landmarks);
  wire.num_landmarks = static_cast<std::int32_t>(wire.landmarks.size());
  wire.num_known = static_cast<std::int32_t>(existence.known);
  wire.num_unused = static_cast<std::int32_t>(existence.unused);
  wire.missing_share = existence.missing_share;
  wire.new_share = existence.new_share;
  wire.mapping_needed = existence.is_mapping_needed ? 1 : 0;
  return wire;
}

Result<model::ExistenceState> from_wire(const existence_state_t& wire) {
  Checks checks;
  model::ExistenceState state;
  take_stamp(wire, state);
  state.map_id = existence_map_id(wire.map_id, checks);
  state.landmarks = existences(wire.landmarks, checks);
  state.model.assign(wire.model.begin(), wire.model.end());
  state.states.assign(wire.states.begin(), wire.states.end());
  const bool fits = state.landmarks.empty() ? state.states.empty()
                                            : state.states.size() % state.landmarks.size() == 0;
  checks.consistent(fits, "each landmark has the same number of state_bytes");
  checks.consistent(existence_hash(state) == static_cast<std::uint64_t>(wire.content_hash),
                    "content_hash is that of model and states");
  return checks.result(state);
}

existence_state_t to_wire(const model::ExistenceState& state) {
  existence_state_t wire{};
  put_stamp(state, wire);
  wire.map_id = static_cast<std::int32_t>(state.map_id);
  wire.landmarks = to_wire(state.landmarks);
  wire.num_landmarks = static_cast<std::int32_t>(wire.landmarks.size());
  wire.model.assign(state.model.begin(), state.model.end());
  wire.model_bytes = static_cast<std::int32_t>(wire.model.size());
  wire.states.assign(state.states.begin(), state.states.end());
  wire.state_bytes = static_cast<std::int32_t>(wire.states.size());
  wire.content_hash = static_cast<std::int64_t>(existence_hash(state));
  return wire;
}

}  // namespace understory::wire
