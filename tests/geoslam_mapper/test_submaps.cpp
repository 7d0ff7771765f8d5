// Parts of the map that are kept elsewhere.
#include <algorithm>
#include <map>
#include <set>

#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

/// A mapper beside a store that answers at once, but for what it has lost.
struct Stack {
  SmoothingMapper mapper;
  std::map<model::SubmapId, model::Submap> stored;
  std::set<model::SubmapId> lost;
  std::size_t most_at_once = 0;  ///< Submaps that went or came with one keyframe.
  std::size_t most_away = 0;
  std::size_t brought_back = 0;
  std::vector<geometry::SE2> map_T_vehicle;

  explicit Stack(const SmoothingMapperParameters& parameters) : mapper(parameters) {}

  void add(const model::Keyframe& keyframe) {
    map_T_vehicle.push_back(mapper.add(keyframe).map_T_vehicle);
    std::vector<model::Submap> given = mapper.take_given_away();
    std::size_t at_once = given.size();
    for (model::Submap& submap : given) {
      for (const model::SubmapId id : submap.replaced) stored.erase(id);
      stored.emplace(submap.id, std::move(submap));
    }
    for (const model::SubmapId id : mapper.wanted()) {
      if (lost.contains(id)) continue;
      ++at_once;
      REQUIRE(stored.contains(id));
      const std::string refused = mapper.bring_back(stored.at(id));
      INFO(refused);
      REQUIRE(refused.empty());
      ++brought_back;
    }
    most_at_once = std::max(most_at_once, at_once);
    most_away = std::max(most_away, mapper.submap_poses().size());
  }
};

SmoothingMapperParameters parameters(double hand_over_m) {
  SmoothingMapperParameters result;
  result.condense_m = 10.0;
  result.hand_over_m = hand_over_m;
  return result;
}

std::vector<model::Keyframe> keyframes_of(const sim::Drive& drive) {
  keyframer::joint::JointKeyframer keyframer({});
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k)
    if (auto keyframe = keyframer.add(drive.scan(k).scan)) result.push_back(*std::move(keyframe));
  return result;
}

/// Four lanes of 300 m through a forest, each in sight of the one before: their far ends are out of
/// reach.
sim::Drive lanes(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kMeander;
  parameters.path.length_m = 1300.0;
  parameters.path.lane_length_m = 300.0;
  parameters.path.lane_spacing_m = 20.0;
  parameters.sensor.range_m = 20.0;
  parameters.sensor.position_sigma_m = 0.05;
  parameters.clear_the_path = true;
  return {parameters, seed};
}

/// Every landmark and keyframe, wherever it is kept, frame map.
struct Whole {
  std::map<model::LandmarkId, Eigen::Vector2d> landmarks;
  std::map<std::uint64_t, geometry::SE2> keyframes;
};

Whole whole(const Stack& stack) {
  Whole result;
  for (const auto& one : stack.mapper.landmarks()) result.landmarks.emplace(one.id, one.position_m);
  for (const auto& one : stack.mapper.trajectory())
    result.keyframes.emplace(one.keyframe_sequence, one.map_T_vehicle);
  for (const model::SubmapPose& pose : stack.mapper.submap_poses()) {
    const auto found = stack.stored.find(pose.id);
    if (found == stack.stored.end()) continue;
    for (const auto& one : found->second.landmarks)
      result.landmarks.emplace(one.id, pose.map_T_submap * one.position_m);
    for (const auto& one : found->second.keyframes)
      result.keyframes.emplace(one.keyframe_sequence, pose.map_T_submap * one.map_T_vehicle);
  }
  return result;
}

}  // namespace

TEST_CASE("What is kept elsewhere changes no estimate", "[mapper]") {
  for (const std::uint64_t seed : {1, 2}) {
    const std::vector<model::Keyframe> keyframes = keyframes_of(lanes(seed));
    Stack bounded(parameters(120.0));
    Stack all(parameters(0.0));
    std::size_t most = 0;
    for (const model::Keyframe& keyframe : keyframes) {
      bounded.add(keyframe);
      all.add(keyframe);
      most = std::max(most, bounded.mapper.landmarks().size());
    }

    // It gave away and took back, and held a part only.
    CHECK(bounded.most_away > 10);
    CHECK(bounded.brought_back > 10);
    CHECK(all.most_away == 0);
    CHECK(most < 0.85 * static_cast<double>(all.mapper.landmarks().size()));

    // Every pose on the way, and all of the map.
    double worst_m = 0.0;
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      worst_m = std::max(
          worst_m,
          (bounded.map_T_vehicle[i].translation() - all.map_T_vehicle[i].translation()).norm());
    }
    CHECK(worst_m < 0.005);
    const Whole kept = whole(bounded);
    const Whole expected = whole(all);
    REQUIRE(kept.landmarks.size() == expected.landmarks.size());
    REQUIRE(kept.keyframes.size() == expected.keyframes.size());
    for (const auto& [id, position_m] : expected.landmarks)
      CHECK((kept.landmarks.at(id) - position_m).norm() < 0.02);
    for (const auto& [sequence, pose] : expected.keyframes)
      CHECK((kept.keyframes.at(sequence).translation() - pose.translation()).norm() < 0.02);
  }
}

TEST_CASE("A mapper with submaps away goes on from its state as if nothing was", "[mapper]") {
  const std::vector<model::Keyframe> keyframes = keyframes_of(lanes(3));
  Stack one(parameters(120.0));
  Stack other(parameters(120.0));
  const std::size_t half = keyframes.size() / 2;
  for (std::size_t i = 0; i < half; ++i) one.add(keyframes[i]);
  REQUIRE(one.mapper.submap_poses().size() > 5);
  other.stored = one.stored;
  other.mapper.load(one.mapper.save());
  CHECK(other.mapper.save().size() == one.mapper.save().size());

  for (std::size_t i = half; i < keyframes.size(); ++i) {
    one.add(keyframes[i]);
    other.add(keyframes[i]);
    CHECK(
        (one.map_T_vehicle.back().translation() - other.map_T_vehicle.back().translation()).norm() <
        1e-3);
  }
  CHECK(other.brought_back > 5);
}

TEST_CASE("One submap goes or comes with a keyframe", "[mapper]") {
  for (const std::uint64_t seed : {6, 7}) {
    Stack stack(parameters(120.0));
    for (const model::Keyframe& keyframe : keyframes_of(lanes(seed))) stack.add(keyframe);
    CHECK(stack.most_at_once == 1);
    CHECK(stack.brought_back > 10);
  }
}

TEST_CASE("A submap that no store has holds up no other", "[mapper]") {
  const std::vector<model::Keyframe> keyframes = keyframes_of(lanes(8));
  Stack all(parameters(120.0));
  Stack stack(parameters(120.0));
  for (const model::Keyframe& keyframe : keyframes) {
    all.add(keyframe);
    stack.add(keyframe);
    if (stack.lost.empty() && stack.brought_back > 2)
      stack.lost.insert(stack.stored.begin()->first);
  }
  REQUIRE_FALSE(stack.lost.empty());
  CHECK(all.brought_back > 10);
  CHECK(stack.brought_back + 3 > all.brought_back);
}

TEST_CASE("A submap that is not as it was given away is refused", "[mapper]") {
  const std::vector<model::Keyframe> keyframes = keyframes_of(lanes(4));
  Stack stack(parameters(120.0));
  std::size_t i = 0;
  while (stack.stored.empty() && i < keyframes.size()) stack.add(keyframes[i++]);
  REQUIRE_FALSE(stack.stored.empty());
  const model::Submap good = stack.stored.begin()->second;
  const auto before = stack.mapper.landmarks();

  model::Submap other = good;
  other.id += 1000;
  CHECK(stack.mapper.bring_back(other).find("not away") != std::string::npos);
  other = good;
  other.map_id = 7;
  CHECK(stack.mapper.bring_back(other).find("another map") != std::string::npos);
  for (const std::size_t at : {std::size_t{30}, good.payload.size() / 2}) {
    other = good;
    other.payload[at] = static_cast<char>(other.payload[at] ^ 1);
    CHECK(stack.mapper.bring_back(other).find("not as it was") != std::string::npos);
    other.content_hash = model::fnv1a(other.payload);
    CHECK(stack.mapper.bring_back(other).find("not as it was") != std::string::npos);
  }
  CHECK(stack.mapper.landmarks().size() == before.size());
  CHECK(stack.mapper.bring_back(good).empty());
  CHECK(stack.mapper.landmarks().size() == before.size() + good.landmarks.size());
  CHECK_FALSE(stack.mapper.bring_back(good).empty());
}

TEST_CASE("Without a store the map stays with the mapper", "[mapper]") {
  const std::vector<model::Keyframe> keyframes = keyframes_of(lanes(5));
  Stack stack(parameters(120.0));
  stack.mapper.may_hand_over(false);
  for (std::size_t i = 0; i < keyframes.size() / 2; ++i) stack.add(keyframes[i]);
  CHECK(stack.most_away == 0);
}
