// Mapper and tracker on one bus: a map of which some trees are gone, hidden, missed or false.
#include "tests/catch.hpp"
#include "tests/existence_tracker/ring_road.hpp"
#include "understory/health_t.hpp"

using namespace understory;
using namespace understory::test;

TEST_CASE("The mapper does not use what is gone, and uses it again when it is back",
          "[existence]") {
  Forest forest(3);
  Stack stack;
  stack.drive(forest, 0, 2 * kLap, {});
  const std::set<std::size_t> gone = forest.felled(0.15);
  stack.drive(forest, 2 * kLap, 3 * kLap, {.gone = gone});
  stack.restart_tracker();
  stack.drive(forest, 3 * kLap, 7 * kLap, {.gone = gone});
  stack.finish();
  CHECK(stack.states > 100);

  // Who is not in use, and is it right? The map's frame is that of the first keyframe.
  std::size_t unused = 0, right = 0, felled = 0;
  for (const model::MapLandmark& landmark : stack.map.landmarks) {
    const auto tree = forest.tree_at(forest.pose(0) * landmark.position_m);
    REQUIRE(tree);
    felled += gone.contains(*tree) ? 1 : 0;
    if (stack.held.at(landmark.id).is_in_use) continue;
    ++unused;
    right += gone.contains(*tree) ? 1 : 0;
  }
  CAPTURE(unused, right, felled);
  CHECK(felled > 5);
  CHECK(right == unused);
  CHECK(right > 0.8 * static_cast<double>(felled));
  CHECK(stack.last.unused == unused);

  // They are still expected, and no pose rests on them.
  const model::MapUpdate& update = stack.updates.back();
  CHECK(update.status == model::MapUpdateStatus::kUpdated);
  std::size_t expected_unused = 0;
  for (const model::ExpectedLandmark& one : update.expected)
    expected_unused += stack.held.at(one.id).is_in_use ? 0 : 1;
  CHECK(expected_unused > 0);

  // They come back: named with their ids at once, and in use after the lap.
  const std::size_t landmarks = stack.map.landmarks.size();
  stack.drive(forest, 7 * kLap, 8 * kLap, {});
  stack.finish();
  CHECK(stack.last.unused == 0);
  CHECK(stack.map.landmarks.size() <= landmarks + 1);
}

TEST_CASE("A first lap asks for no mapping, a lap through another forest does", "[existence]") {
  Forest forest(3);
  Stack stack;
  double most_new = 0.0;
  std::size_t asked = 0;
  const auto drive_lap = [&](Forest& driven, int lap) {
    for (int k = lap * kLap; k < (lap + 1) * kLap; ++k) {
      stack.drive(driven, k, k + 1, {});
      most_new = std::max(most_new, stack.last.new_share);
      asked += stack.last.is_mapping_needed ? 1 : 0;
    }
  };
  drive_lap(forest, 0);
  CHECK(most_new > 0.9);
  CHECK(asked == 0);
  drive_lap(forest, 1);
  CHECK(asked == 0);

  const std::set<std::size_t> felled = forest.felled(0.6);
  stack.drive(forest, 2 * kLap, 3 * kLap, {.gone = felled});
  CHECK(stack.last.is_mapping_needed);
}

TEST_CASE("What lorries hide stays where the sensor has ranges, what is gone leaves use",
          "[existence]") {
  Forest forest(5);
  const std::set<std::size_t> felled = forest.felled(0.15);
  std::set<std::size_t> hidden;
  for (std::size_t i = 0; i < forest.size(); ++i)
    if (forest.is_hidden(i) && !felled.contains(i)) hidden.insert(i);
  REQUIRE(hidden.size() >= 4);

  const auto hidden_in_use = [&](bool has_ranges, const std::string& toml) {
    Forest same = forest;
    Stack stack(toml);
    stack.drive_laps(same, 0, 2, {.has_ranges = has_ranges});
    stack.drive_laps(same, 2, 8, {.gone = felled, .has_lorries = true, .has_ranges = has_ranges});
    stack.finish();
    const Stack::Count count = stack.count(forest);
    std::size_t in_use = 0, gone = 0, gone_in_use = 0;
    for (const std::size_t i : hidden) in_use += count.in_use.contains(i) ? 1 : 0;
    for (const std::size_t i : felled) gone += count.ids.contains(i) ? 1 : 0;
    for (const std::size_t i : felled) gone_in_use += count.in_use.contains(i) ? 1 : 0;
    CAPTURE(has_ranges, toml, in_use, hidden.size(), gone_in_use, gone);
    CHECK(gone > 5);
    CHECK(static_cast<double>(gone_in_use) <= 0.2 * static_cast<double>(gone));
    return in_use;
  };
  CHECK(hidden_in_use(true, "") == hidden.size());
  // Without them six laps past the lorries take them for gone.
  CHECK(hidden_in_use(false, "") < hidden.size() / 2);
  CHECK(hidden_in_use(true, "use_ranges = false\n") < hidden.size() / 2);
}

TEST_CASE("SLAM_UPDATE says what was hidden and what was in clear view", "[existence]") {
  Forest forest(5);
  Stack stack;
  stack.drive_laps(forest, 0, 1, {});
  const std::set<std::size_t> felled = forest.felled(0.15);
  stack.drive_laps(forest, 1, 2, {.gone = felled, .has_lorries = true});
  stack.finish();
  const Stack::Count count = stack.count(forest);
  std::map<model::LandmarkId, std::size_t> tree_of;
  for (const auto& [tree, id] : count.ids) tree_of[id] = tree;
  std::size_t blocked = 0, clear = 0, wrong = 0;
  for (const model::MapUpdate& update : stack.updates) {
    for (const model::ExpectedLandmark& one : update.expected) {
      if (!tree_of.contains(one.id) || one.sight == model::LineOfSight::kUnknown) continue;
      const bool is_felled = felled.contains(tree_of.at(one.id));
      if (one.sight == model::LineOfSight::kClear) {
        ++clear;
        wrong += is_felled ? 0 : 1;
      } else {
        ++blocked;
      }
    }
  }
  CAPTURE(blocked, clear, wrong);
  CHECK(blocked > 80);
  CHECK(clear > 100);
  CHECK(wrong == 0);
}

TEST_CASE("A tree that was missed on two laps is in use after the third one, with its id",
          "[existence]") {
  for (const std::uint64_t seed : {6, 7}) {
    Forest forest(seed);
    Stack stack;
    stack.drive_laps(forest, 0, 2, {});
    const std::set<std::size_t> missed = forest.felled(0.15);
    stack.drive_laps(forest, 2, 4, {.missed = missed});
    stack.finish();
    const Stack::Count before = stack.count(forest);
    stack.drive_laps(forest, 4, 5, {});
    stack.finish();
    const Stack::Count after = stack.count(forest);
    std::size_t left = 0;
    for (const std::size_t i : missed) {
      if (!before.ids.contains(i)) continue;
      CAPTURE(seed, i);
      left += before.unused.contains(i) ? 1 : 0;
      CHECK(after.in_use.contains(i));
      CHECK(after.ids.at(i) == before.ids.at(i));
    }
    CAPTURE(seed, left);
    CHECK(after.unused.empty());
  }
}

TEST_CASE("A forest that does not change keeps its trees, a third of them missed on each lap",
          "[existence]") {
  std::size_t unused = 0, all = 0;
  for (const std::uint64_t seed : {8, 9}) {
    Forest forest(seed);
    Stack stack;
    stack.drive_laps(forest, 0, 1, {});
    for (int lap = 1; lap < 7; ++lap)
      stack.drive_laps(forest, lap, lap + 1, {.missed = forest.felled(0.36), .has_ranges = false});
    stack.finish();
    const Stack::Count count = stack.count(forest);
    unused += count.unused.size();
    all += count.ids.size();
  }
  CAPTURE(unused, all);
  CHECK(all > 150);
  CHECK(static_cast<double>(unused) <= 0.01 * static_cast<double>(all));
}

TEST_CASE("Of false detections next to nothing is in the map at the end", "[existence]") {
  for (const double share : {0.1, 0.3}) {
    Forest forest(10);
    Stack stack;
    stack.drive_laps(forest, 0, 5, {.false_share = share});
    stack.finish();
    const Stack::Count count = stack.count(forest);
    std::size_t beside = 0, in_use = 0;
    for (std::size_t i = 0; i < forest.size(); ++i) {
      if (!forest.is_beside_road(i)) continue;
      ++beside;
      in_use += count.in_use.contains(i) ? 1 : 0;
    }
    CAPTURE(share, stack.map.landmarks.size(), count.false_in_use, count.in_use.size(), beside);
    CHECK(static_cast<double>(count.false_in_use) <=
          0.01 * static_cast<double>(count.in_use.size()));
    CHECK(static_cast<double>(in_use) >= 0.97 * static_cast<double>(beside));
  }
}
