// The tracker alone: what goes, what stays, what comes back.
#include <memory>

#include "common/wire/convert.hpp"
#include "services/existence_tracker/existence_tracker.hpp"
#include "tests/catch.hpp"
#include "tests/existence_tracker/past_landmarks.hpp"

using namespace understory;
using existence_tracker::ExistenceTracker;
using existence_tracker::TrackerParameters;
using test::Road;

namespace {

constexpr model::Utime kDay_us = 86'400'000'000;

TrackerParameters for_road() {
  TrackerParameters parameters;
  parameters.model.range_m = Road::kRangeM;
  return parameters;
}

/// Another drive of another day: the tracker begins with what it knew.
ExistenceTracker next_day(ExistenceTracker& tracker, const Road& road) {
  ExistenceTracker next(for_road());
  next.begin_with(tracker.take_states());
  next.on_map(road.map());
  return next;
}

model::Existence drive(const std::vector<model::MapUpdate>& updates, ExistenceTracker& tracker) {
  std::optional<model::Existence> last;
  for (const model::MapUpdate& update : updates) last = tracker.on_update(update);
  return last.value();
}

std::size_t unused_of(const std::set<model::LandmarkId>& ids, const ExistenceTracker& tracker) {
  return static_cast<std::size_t>(std::count_if(ids.begin(), ids.end(), [&](model::LandmarkId id) {
    const auto one = tracker.of(id);
    return one && !one->is_in_use;
  }));
}

}  // namespace

TEST_CASE("What is gone leaves use, what is missed by chance stays", "[existence]") {
  std::size_t gone_all = 0, gone_unused = 0, there_all = 0, there_unused = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    Road road(seed);
    const auto all_seen = [&](model::LandmarkId) { return road.chance(0.85); };
    ExistenceTracker tracker(for_road());
    tracker.on_map(road.map());
    drive(road.drive(0, all_seen), tracker);

    // A fifth is felled; of the others each drive misses a fifth altogether.
    const auto felled = road.draw(0.2);
    for (int day = 1; day <= 4; ++day) {
      tracker = next_day(tracker, road);
      const auto missed = road.draw(0.2);
      drive(road.drive(day * kDay_us,
                       [&](model::LandmarkId id) {
                         return !felled.contains(id) && !missed.contains(id) && road.chance(0.85);
                       }),
            tracker);
    }
    std::set<model::LandmarkId> there;
    for (model::LandmarkId id = 1; id <= road.size(); ++id)
      if (!felled.contains(id)) there.insert(id);
    gone_all += felled.size();
    gone_unused += unused_of(felled, tracker);
    there_all += there.size();
    there_unused += unused_of(there, tracker);
  }
  CAPTURE(gone_unused, gone_all, there_unused, there_all);
  CHECK(gone_unused > 0.9 * static_cast<double>(gone_all));
  CHECK(there_unused <= 0.02 * static_cast<double>(there_all));
}

TEST_CASE("A landmark that was missed on two drives is in use after one good pass", "[existence]") {
  for (const std::uint64_t seed : {4, 5, 6}) {
    Road road(seed);
    ExistenceTracker tracker(for_road());
    tracker.on_map(road.map());
    drive(road.drive(0, [&](model::LandmarkId) { return true; }), tracker);
    const auto missed = road.draw(0.1);
    for (int day = 1; day <= 2; ++day) {
      tracker = next_day(tracker, road);
      drive(road.drive(day * kDay_us, [&](model::LandmarkId id) { return !missed.contains(id); }),
            tracker);
    }
    const std::size_t dropped = unused_of(missed, tracker);
    tracker = next_day(tracker, road);
    drive(road.drive(3 * kDay_us, [&](model::LandmarkId) { return true; }), tracker);
    CAPTURE(seed, dropped, missed.size());
    CHECK(unused_of(missed, tracker) == 0);
  }
}

TEST_CASE("Without a change next to nothing is removed", "[existence]") {
  std::size_t unused = 0, all = 0;
  for (const std::uint64_t seed : {7, 8, 9}) {
    Road road(seed);
    ExistenceTracker tracker(for_road());
    tracker.on_map(road.map());
    for (int day = 0; day < 6; ++day) {
      if (day > 0) tracker = next_day(tracker, road);
      const auto missed = road.draw(0.36);
      drive(road.drive(
                day * kDay_us,
                [&](model::LandmarkId id) { return !missed.contains(id) && road.chance(0.9); }),
            tracker);
    }
    std::set<model::LandmarkId> everything = road.draw(1.0);
    unused += unused_of(everything, tracker);
    all += everything.size();
  }
  CAPTURE(unused, all);
  CHECK(unused <= 0.01 * static_cast<double>(all));
}

TEST_CASE("Lanes of one drive see a landmark or miss it for one reason", "[existence]") {
  constexpr model::Utime kLane_us = 600'000'000;
  const auto unused_after_lanes = [](double pass_s, int lanes_before, int lanes_after) {
    TrackerParameters parameters = for_road();
    parameters.looks.pass_m = 100.0;
    parameters.looks.pass_s = pass_s;
    std::size_t unused = 0;
    for (const std::uint64_t seed : {21, 22, 23}) {
      Road road(seed);
      auto tracker = std::make_unique<ExistenceTracker>(parameters);
      tracker->on_map(road.map());
      const auto lane = [&](model::Utime utime, const std::set<model::LandmarkId>& missed) {
        drive(road.drive(utime, [&](model::LandmarkId id) { return !missed.contains(id); }),
              *tracker);
        const std::string saved = tracker->save();  // It is killed and goes on.
        tracker = std::make_unique<ExistenceTracker>(parameters);
        tracker->load(saved);
      };
      for (int k = 0; k < lanes_before; ++k) lane(k * kLane_us, {});
      const auto states = tracker->take_states();
      tracker = std::make_unique<ExistenceTracker>(parameters);
      tracker->begin_with(states);
      tracker->on_map(road.map());

      const auto missed = road.draw(0.36);
      for (int k = 0; k < lanes_after; ++k) lane(30 * kDay_us + k * kLane_us, missed);
      unused += unused_of(missed, *tracker);
    }
    return unused;
  };
  // Five lanes that see all of them do not show that another drive misses none.
  CHECK(unused_after_lanes(14'400.0, 5, 1) == 0);
  // Nor do five passes: each drive has a recall of its own.
  CHECK(unused_after_lanes(0.0, 5, 1) == 0);
  // Five lanes that miss a third of them have missed it once.
  CHECK(unused_after_lanes(14'400.0, 1, 5) == 0);
  CHECK(unused_after_lanes(0.0, 1, 5) > 50);
}

TEST_CASE("A mapping-needed signal where half of the map is another one", "[existence]") {
  Road road(10);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  drive(road.drive(0, [&](model::LandmarkId) { return road.chance(0.9); }), tracker);
  for (int day = 1; day <= 3; ++day) {
    tracker = next_day(tracker, road);
    const auto same = drive(
        road.drive(day * kDay_us, [&](model::LandmarkId) { return road.chance(0.9); }), tracker);
    CHECK_FALSE(same.is_mapping_needed);
  }

  tracker = next_day(tracker, road);
  const auto gone = road.draw(0.6);
  const auto changed = drive(
      road.drive(4 * kDay_us,
                 [&](model::LandmarkId id) { return !gone.contains(id) && road.chance(0.9); }),
      tracker);
  CHECK(changed.missing_share > 0.45);
  CHECK(changed.is_mapping_needed);
}

TEST_CASE("All who listen know every landmark in the end, and each message is sound",
          "[existence]") {
  Road road(11);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  std::map<model::LandmarkId, model::LandmarkExistence> held;
  for (const model::MapUpdate& update :
       road.drive(0, [&](model::LandmarkId) { return road.chance(0.7); })) {
    const auto existence = tracker.on_update(update);
    REQUIRE(existence);
    const auto back = wire::decode_message<model::Existence>(wire::encode_message(*existence));
    REQUIRE(back);
    CHECK(back->landmarks == existence->landmarks);
    // Some messages are lost.
    if (road.chance(0.3)) continue;
    for (const model::LandmarkExistence& one : existence->landmarks) held[one.id] = one;
  }
  CHECK(held.size() > 0.95 * static_cast<double>(road.size()));
  for (const auto& [id, one] : held)
    CHECK(std::abs(one.probability - tracker.of(id)->probability) < 0.05);
}

TEST_CASE("A saved tracker goes on as the other one, and states are the points", "[existence]") {
  Road road(12);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  const auto updates = road.drive(0, [&](model::LandmarkId) { return road.chance(0.6); });
  const std::size_t half = updates.size() / 2;
  for (std::size_t i = 0; i < half; ++i) tracker.on_update(updates[i]);

  ExistenceTracker loaded(for_road());
  loaded.load(tracker.save());
  CHECK(loaded.save() == tracker.save());
  for (std::size_t i = half; i < updates.size(); ++i) {
    const auto a = tracker.on_update(updates[i]);
    const auto b = loaded.on_update(updates[i]);
    REQUIRE(wire::encode_message(*a) == wire::encode_message(*b));
  }

  const auto states = tracker.take_states();
  std::size_t told = 0;
  for (const model::ExistenceState& state : states) {
    told += state.landmarks.size();
    CHECK(wire::decode_message<model::ExistenceState>(wire::encode_message(state)));
  }
  CHECK(told == road.size());
  CHECK(tracker.take_states().empty());
  ExistenceTracker next(for_road());
  next.begin_with(states);
  for (model::LandmarkId id = 1; id <= road.size(); ++id)
    CHECK(next.of(id)->probability == Approx(tracker.of(id)->probability));

  // States of a map file of before: without what is known of births and of the rates of then.
  std::vector<model::ExistenceState> older = states;
  for (model::ExistenceState& state : older) {
    const std::size_t bytes = state.states.size() / state.landmarks.size();
    std::string points;
    for (std::size_t i = 0; i < state.landmarks.size(); ++i)
      points += state.states.substr(i * bytes, bytes - 1 - sizeof(double));
    state.states = points;
    state.model.resize(state.model.size() - 2 * sizeof(double));
  }
  ExistenceTracker of_older(for_road());
  of_older.begin_with(older);
  for (model::LandmarkId id = 1; id <= road.size(); ++id)
    CHECK(of_older.of(id)->probability == next.of(id)->probability);

  auto cut = states;
  cut.front().states.pop_back();
  CHECK_THROWS_AS(next.begin_with(cut), std::invalid_argument);
  CHECK(next.of(1));  // As it was.
  CHECK_THROWS_AS(next.load("nonsense"), std::invalid_argument);
}

TEST_CASE("Merged, removed and unknown landmarks", "[existence]") {
  Road road(13, 20);
  ExistenceTracker tracker(for_road());
  auto updates = road.drive(0, [&](model::LandmarkId) { return true; });
  CHECK_FALSE(tracker.wants_map());
  tracker.on_update(updates.front());
  CHECK(tracker.wants_map());
  CHECK(tracker.counters().without_place > 0);
  tracker.on_map(road.map());
  CHECK_FALSE(tracker.wants_map());
  for (const model::MapUpdate& update : updates) tracker.on_update(update);
  REQUIRE(tracker.of(3));

  model::MapUpdate update = updates.back();
  update.associations.clear();
  update.expected.clear();
  update.merged = {{3, 4}};
  update.removed = {5};
  tracker.on_update(update);
  CHECK_FALSE(tracker.of(3));
  CHECK_FALSE(tracker.of(5));
  CHECK(tracker.of(4)->probability > 0.9);

  // New, and merged by the next keyframe: before its place is known, and after.
  for (const bool is_placed : {false, true}) {
    const model::LandmarkId id = road.add({150.0, 6.0});
    update.added = {id};
    update.merged.clear();
    update.removed.clear();
    tracker.on_update(update);
    if (is_placed) tracker.on_map(road.map());
    update.added.clear();
    update.merged = {{id, 4}};
    REQUIRE(tracker.on_update(update));
    tracker.on_map(road.map());
    CHECK_FALSE(tracker.of(id));
    const auto told = tracker.on_update(updates.back());
    CHECK(std::ranges::none_of(told->landmarks, [&](const auto& one) { return one.id == id; }));
  }

  // Without a place nothing counts.
  update.status = model::MapUpdateStatus::kNotSure;
  CHECK_FALSE(tracker.on_update(update));
}

TEST_CASE("A landmark that a keyframe sees and merges is the one that lives on", "[existence]") {
  Road road(13, 20);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  const auto updates = road.drive(0, [&](model::LandmarkId) { return true; });
  for (const model::MapUpdate& update : updates) tracker.on_update(update);

  model::MapUpdate update = updates.back();
  update.expected.clear();
  update.associations = {{0, 3}, {1, 4}, {2, 6}};
  update.merged = {{6, 3}, {3, 4}};
  const std::uint64_t hits = tracker.counters().hits;
  tracker.on_update(update);
  CHECK_FALSE(tracker.of(3));
  CHECK_FALSE(tracker.of(6));
  CHECK(tracker.counters().hits == hits + 1);
}

TEST_CASE("A false landmark of this drive leaves use when nobody sees it again", "[existence]") {
  Road road(14);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  drive(road.drive(0, [&](model::LandmarkId) { return road.chance(0.9); }), tracker);
  // A pedestrian stood there.
  const model::LandmarkId pedestrian = road.add({150.0, 6.0});
  auto updates = road.drive(
      kDay_us, [&](model::LandmarkId id) { return id != pedestrian && road.chance(0.9); });
  bool is_born = false;
  tracker = next_day(tracker, road);
  for (model::MapUpdate& update : updates) {
    if (!is_born && std::erase(update.expected, model::ExpectedLandmark{pedestrian}) > 0) {
      update.added.push_back(pedestrian);
      is_born = true;
    }
    tracker.on_update(update);
    tracker.on_delta(model::MapDelta{});
  }
  REQUIRE(is_born);
  REQUIRE(tracker.of(pedestrian));
  CHECK(tracker.of(pedestrian)->probability < 0.3);
}

TEST_CASE("Where most of what is new is false, it is out of use from its first keyframe on",
          "[existence]") {
  Road road(15);
  ExistenceTracker tracker(for_road());
  tracker.on_map(road.map());
  std::set<model::LandmarkId> pedestrians;
  const auto seen = [&](model::LandmarkId id) { return !pedestrians.contains(id); };
  drive(road.drive(0, seen), tracker);
  // Each day others stand there.
  for (int day = 1; day <= 3; ++day) {
    tracker = next_day(tracker, road);
    std::vector<model::MapUpdate> updates = road.drive(day * kDay_us, seen);
    for (std::size_t i = 0; i < updates.size(); i += 2) {
      const model::LandmarkId pedestrian =
          road.add(updates[i].map_T_vehicle.translation() + Eigen::Vector2d(0.0, 6.0));
      pedestrians.insert(pedestrian);
      updates[i].added.push_back(pedestrian);
      const auto existence = tracker.on_update(updates[i]);
      REQUIRE(existence);
      const auto told =
          std::ranges::find(existence->landmarks, pedestrian, &model::LandmarkExistence::id);
      REQUIRE(told != existence->landmarks.end());
      CHECK(told->is_in_use == (day < 3));
      CHECK(std::ranges::is_sorted(existence->landmarks, {}, &model::LandmarkExistence::id));
      tracker.on_map(road.map());
    }
  }
}

namespace {

/// What the mapper says of landmarks behind a stack: blocked, but for looks past its edges.
void hide(const std::set<model::LandmarkId>& hidden, const Road& road,
          std::vector<model::MapUpdate>& updates) {
  const model::WholeMap map = road.map();
  for (model::MapUpdate& update : updates) {
    for (model::ExpectedLandmark& one : update.expected) {
      if (!hidden.contains(one.id)) continue;
      const double ahead_m =
          map.landmarks[one.id - 1].position_m.x() - update.map_T_vehicle.translation().x();
      const bool is_at_edge = std::abs(ahead_m) > 0.6 * Road::kRangeM;
      one.sight = is_at_edge ? model::LineOfSight::kUnknown : model::LineOfSight::kBlocked;
    }
  }
}

}  // namespace

TEST_CASE("What is hidden but for unknown edges stays in use, what is gone leaves it",
          "[existence]") {
  for (const std::uint64_t seed : {21, 22}) {
    Road road(seed);
    ExistenceTracker tracker(for_road());
    tracker.on_map(road.map());
    std::set<model::LandmarkId> left_by_mistake;
    const auto drive_without = [&](int day, const std::set<model::LandmarkId>& unseen,
                                   const std::set<model::LandmarkId>& hidden) {
      auto updates =
          road.drive(day * kDay_us, [&](model::LandmarkId id) { return !unseen.contains(id); });
      hide(hidden, road, updates);
      // The process ends in the middle of the passes, and goes on with what it saved.
      for (std::size_t i = 0; i < updates.size(); ++i) {
        tracker.on_update(updates[i]);
        for (const model::ExpectedLandmark& one : updates[i].expected)
          if (one.sight == model::LineOfSight::kBlocked && !tracker.of(one.id)->is_in_use)
            left_by_mistake.insert(one.id);
        if (i != updates.size() / 2) continue;
        ExistenceTracker loaded(for_road());
        loaded.load(tracker.save());
        REQUIRE(loaded.save() == tracker.save());
        tracker = loaded;
      }
      tracker = next_day(tracker, road);
    };
    for (int day = 0; day < 4; ++day) drive_without(day, {}, {});

    const auto felled = road.draw(0.1);
    std::set<model::LandmarkId> hidden = road.draw(0.1);
    for (const model::LandmarkId id : felled) hidden.erase(id);
    std::set<model::LandmarkId> unseen = felled;
    unseen.insert(hidden.begin(), hidden.end());
    for (int day = 4; day < 9; ++day) drive_without(day, unseen, hidden);
    CAPTURE(seed, felled.size(), hidden.size());
    CHECK(unused_of(felled, tracker) >= felled.size() - 1);
    CHECK(unused_of(hidden, tracker) == 0);
    CHECK(left_by_mistake.empty());

    // The stack leaves, and some of what stood behind it is gone.
    const model::LandmarkId taken = *hidden.begin();
    std::set<model::LandmarkId> still_gone = felled;
    still_gone.insert(taken);
    for (int day = 9; day < 12; ++day) drive_without(day, still_gone, {});
    CHECK(unused_of({taken}, tracker) == 1);
  }
}
