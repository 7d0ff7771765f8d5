// What became of the landmarks, counted as they change, is what a recount finds.
#include <memory>
#include <random>

#include "common/wire/convert.hpp"
#include "services/existence_tracker/existence_tracker.hpp"
#include "services/existence_tracker/landmark_places.hpp"
#include "tests/catch.hpp"
#include "tests/existence_tracker/past_landmarks.hpp"

using namespace understory;
using existence_tracker::ExistenceTracker;
using existence_tracker::LandmarkPlaces;
using test::Road;

namespace {

constexpr model::Utime kDay_us = 86'400'000'000;

existence_tracker::TrackerParameters for_short_passes() {
  existence_tracker::TrackerParameters parameters;
  parameters.model.range_m = Road::kRangeM;
  parameters.looks.pass_s = 60.0;
  parameters.looks.pass_m = 80.0;
  return parameters;
}

/// A landmark born, one removed or two merged now and then, besides what is seen.
void disturb(Road& road, model::MapUpdate& update, ExistenceTracker& tracker) {
  if (update.associations.size() < 4 || !road.chance(0.2)) return;
  const model::LandmarkId some = update.associations.back().landmark_id;
  update.associations.pop_back();
  if (road.chance(0.3)) {
    update.removed = {some};
  } else if (road.chance(0.5)) {
    update.merged = {{some, update.associations.front().landmark_id}};
  } else {
    model::MapLandmark one;
    one.id = road.add(update.map_T_vehicle.translation() + Eigen::Vector2d(3.0, 5.0));
    one.position_m = update.map_T_vehicle.translation() + Eigen::Vector2d(3.0, 5.0);
    update.added = {one.id};
    tracker.on_update(update);
    model::MapDelta delta;
    delta.added = {one};
    tracker.on_delta(delta);
  }
}

}  // namespace

TEST_CASE("Histories that are kept are those of a recount", "[existence]") {
  for (const std::uint64_t seed : {41, 42, 43, 44}) {
    Road road(seed, 80);
    auto tracker = std::make_unique<ExistenceTracker>(for_short_passes());
    tracker->on_map(road.map());
    for (int day = 0; day < 4; ++day) {
      if (day > 0) {
        auto next = std::make_unique<ExistenceTracker>(for_short_passes());
        next->begin_with(tracker->take_states());
        next->on_map(road.map());
        tracker = std::move(next);
      }
      const auto missed = road.draw(0.1 * static_cast<double>(seed % 3) + 0.2);
      const auto is_seen = [&](model::LandmarkId id) {
        return !missed.contains(id) && road.chance(0.8);
      };
      for (model::MapUpdate& update : road.drive(day * kDay_us, is_seen)) {
        disturb(road, update, *tracker);
        tracker->on_update(update);
        CAPTURE(seed, day, update.keyframe_sequence);
        REQUIRE(tracker->histories() == tracker->recount());
      }
    }
    CHECK(tracker->recount().size() > 5);
  }
}

TEST_CASE("A tracker that counts all anew before each keyframe says the same", "[existence]") {
  Road road(45, 80);
  ExistenceTracker tracker(for_short_passes());
  ExistenceTracker anew(for_short_passes());
  tracker.on_map(road.map());
  anew.on_map(road.map());
  for (int day = 0; day < 3; ++day) {
    const auto missed = road.draw(0.3);
    const auto is_seen = [&](model::LandmarkId id) { return !missed.contains(id); };
    for (const model::MapUpdate& update : road.drive(day * kDay_us, is_seen)) {
      ExistenceTracker loaded(for_short_passes());
      loaded.load(anew.save());
      anew = std::move(loaded);
      const auto kept = tracker.on_update(update), counted = anew.on_update(update);
      REQUIRE(wire::encode_message(*kept) == wire::encode_message(*counted));
    }
  }
}

TEST_CASE("Landmarks around a place are those that a search of all finds", "[existence]") {
  std::mt19937_64 random(46);
  std::uniform_real_distribution<double> across(-200.0, 200.0);
  LandmarkPlaces places;
  for (int round = 0; round < 50; ++round) {
    model::MapDelta delta;
    for (int i = 0; i < 20; ++i) {
      model::MapLandmark one;
      one.id = random() % 300 + 1;
      one.position_m = {across(random), across(random)};
      (places.at(one.id) ? delta.moved : delta.added).push_back(one);
    }
    for (int i = 0; i < 5; ++i) delta.removed.push_back(random() % 300 + 1);
    places.take(delta);
    const Eigen::Vector2d place_m(across(random), across(random));
    std::vector<model::LandmarkId> all;
    for (model::LandmarkId id = 1; id <= 300; ++id)
      if (const auto at_m = places.at(id); at_m && (*at_m - place_m).norm() <= 70.0)
        all.push_back(id);
    REQUIRE(places.near(place_m, 70.0) == all);
  }
}
