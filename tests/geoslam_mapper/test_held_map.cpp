// What a listener has by MAP, MAP_DELTA and SLAM_UPDATE.
#include <random>

#include "common/model/held_map.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

model::MapLandmark tree(model::LandmarkId id, double x_m) {
  model::MapLandmark one;
  one.id = id;
  one.position_m = {x_m, 0.0};
  return one;
}

model::MapDelta change(std::uint64_t base, std::vector<model::MapLandmark> added) {
  model::MapDelta delta;
  delta.utime = static_cast<model::Utime>(base + 1);
  delta.base_version = base;
  delta.version = base + 1;
  delta.added = std::move(added);
  return delta;
}

model::MapUpdate accepted(std::uint64_t keyframe, bool is_first = false) {
  model::MapUpdate update;
  update.keyframe_sequence = keyframe;
  update.utime = static_cast<model::Utime>(1000 * (keyframe + 1));
  update.status = is_first ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;
  return update;
}

model::WholeMap whole(std::uint64_t version, std::vector<model::MapLandmark> landmarks) {
  model::WholeMap map;
  map.version = version;
  map.landmarks = std::move(landmarks);
  return map;
}

std::vector<model::LandmarkId> ids(const model::HeldMap& held) {
  std::vector<model::LandmarkId> result;
  for (const auto& one : held.map()->landmarks) result.push_back(one.id);
  return result;
}

}  // namespace

TEST_CASE("a map is held from its start on, without any MAP", "[held_map]") {
  model::HeldMap held;
  held.take(accepted(0, true));
  held.take(change(0, {tree(1, 0.0), tree(5, 1.0)}));
  held.take(accepted(1));
  held.take(change(1, {tree(3, 2.0)}));
  REQUIRE(held.map());
  CHECK(ids(held) == std::vector<model::LandmarkId>{1, 3, 5});
  CHECK(held.map()->keyframes.size() == 2);
  CHECK(held.map()->version == 2);
  CHECK_FALSE(held.has_whole());
  CHECK(held.missed() == 0);
}

TEST_CASE("who comes late waits for a MAP, and follows from there", "[held_map]") {
  model::HeldMap held;
  held.take(accepted(7));
  held.take(change(6, {tree(9, 0.0)}));
  CHECK_FALSE(held.map());

  auto cut = whole(7, {tree(1, 0.0)});
  cut.complete = false;
  held.take(cut);
  CHECK_FALSE(held.map());

  held.take(whole(7, {tree(1, 0.0), tree(9, 0.0)}));
  CHECK(held.has_whole());
  held.take(change(6, {tree(8, 0.0)}));  // It is in the whole.
  model::MapDelta merge = change(7, {});
  merge.merged = {{1, 9}};
  merge.moved = {tree(9, 4.0)};
  held.take(merge);
  CHECK(ids(held) == std::vector<model::LandmarkId>{9});
  CHECK(held.map()->landmarks[0].position_m.x() == 4.0);
  CHECK(held.missed() == 0);
}

TEST_CASE("a change that is missing is counted until the next MAP", "[held_map]") {
  model::HeldMap held;
  held.take(whole(3, {tree(1, 0.0)}));
  held.take(change(4, {tree(2, 0.0)}));
  CHECK(held.missed() == 1);
  CHECK(ids(held) == std::vector<model::LandmarkId>{1, 2});
  held.take(change(5, {}));
  CHECK(held.missed() == 1);
  held.take(whole(6, {}));
  CHECK(held.missed() == 0);
}

TEST_CASE("a map that starts anew replaces the one before", "[held_map]") {
  model::HeldMap held;
  held.take(whole(30, {tree(1, 0.0)}));
  held.take(accepted(4));
  held.take(accepted(0, true));
  held.take(change(0, {tree(2, 0.0)}));
  CHECK(ids(held) == std::vector<model::LandmarkId>{2});
  CHECK(held.map()->keyframes.size() == 1);

  held.take(change(0, {tree(3, 0.0)}));  // A given map has no update that starts it.
  CHECK(ids(held) == std::vector<model::LandmarkId>{3});
}

TEST_CASE("another map of the same mapper replaces the one before, though its versions go on",
          "[held_map]") {
  model::HeldMap held;
  held.take(whole(30, {tree(1, 0.0)}));
  held.take(accepted(40, true));
  model::MapDelta delta = change(30, {tree(2, 0.0)});
  delta.base_version = 0;
  held.take(delta);
  CHECK(ids(held) == std::vector<model::LandmarkId>{2});
  CHECK(held.map()->version == 31);
  CHECK(held.map()->keyframes.size() == 1);
  CHECK(held.missed() == 0);

  // Who missed the update has it by the change alone.
  held.take(whole(40, {tree(1, 0.0)}));
  delta.version = 41;
  held.take(delta);
  CHECK(ids(held) == std::vector<model::LandmarkId>{2});
  CHECK(held.missed() == 0);
}

TEST_CASE("a map has jumped where most of its landmarks are displaced", "[held_map]") {
  std::vector<model::MapLandmark> before;
  for (model::LandmarkId id = 1; id <= 10; ++id) before.push_back(tree(id, 0.0));
  model::MapDelta delta = change(0, {tree(11, 9.0)});
  for (model::LandmarkId id = 1; id <= 10; ++id) delta.moved.push_back(tree(id, id <= 5 ? 2 : 0.5));
  CHECK_FALSE(geoslam_mapper::displaces_most(before, delta, 1.0));
  delta.moved[9].position_m.x() = 2.0;
  CHECK(geoslam_mapper::displaces_most(before, delta, 1.0));
}
