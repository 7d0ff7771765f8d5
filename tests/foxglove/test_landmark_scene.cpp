#include <random>

#include "common/foxglove/landmark_scene.hpp"
#include "common/model/held_map.hpp"
#include "tests/catch.hpp"
#include "tests/foxglove/shown_scene.hpp"

namespace understory::foxglove {
namespace {

constexpr std::size_t kEnough = 1000;

model::MapLandmark landmark(std::mt19937_64& random, std::uint64_t counter) {
  std::uniform_real_distribution<double> place(-100.0, 100.0);
  model::MapLandmark one;
  one.id = (model::LandmarkId{1} << model::kLandmarkCounterBits) + counter;
  one.position_m = {place(random), place(random)};
  one.radius_m = 0.2;
  one.kind = counter % 3 == 0 ? model::LandmarkKind::kCorner : model::LandmarkKind::kTrunk;
  return one;
}

/// A mapper that changes its map at random.
class RandomMapper {
 public:
  explicit RandomMapper(std::uint64_t seed) : random_(seed) {}

  model::MapDelta change() {
    model::MapDelta delta;
    delta.utime = ++utime_;
    delta.base_version = version_;
    delta.version = ++version_;
    for (std::uint64_t i = random_() % 6; i > 0; --i) {
      const auto one = landmark(random_, ++counter_);
      map_[one.id] = one;
      delta.added.push_back(one);
    }
    for (auto place = map_.begin(); place != map_.end();) {
      const auto next = std::next(place);
      const std::uint64_t dice = random_() % 30;
      if (dice == 0) {
        delta.removed.push_back(place->first);
        map_.erase(place);
      } else if (dice == 1 && map_.size() > 1) {
        delta.merged.emplace_back(place->first, map_.rbegin()->first);
        map_.erase(place);
      } else if (dice < 6) {
        place->second.position_m.x() += 0.1;
        delta.moved.push_back(place->second);
      }
      place = next;
    }
    return delta;
  }
  model::Existence existence() {
    model::Existence result;
    result.utime = utime_;
    for (const auto& [id, one] : map_) {
      if (random_() % 4 == 0) {
        known_[id] = {id, static_cast<double>(random_() % 101) / 100.0, random_() % 5 != 0};
        result.landmarks.push_back(known_[id]);
      }
    }
    return result;
  }
  model::Submap submap() {
    model::Submap result;
    result.utime = utime_;
    result.id = ++submaps_;
    if (submaps_ % 3 == 0) result.replaced.push_back(submaps_ - 1);
    for (auto place = map_.begin(); place != map_.end() && result.landmarks.size() < 9;) {
      result.landmarks.push_back(place->second);
      place = map_.erase(place);
    }
    return result;
  }
  model::WholeMap whole() const {
    model::WholeMap map;
    map.utime = utime_;
    map.version = version_;
    for (const auto& [id, one] : map_) map.landmarks.push_back(one);
    return map;
  }
  model::Existence all_known() const {
    model::Existence result;
    result.utime = utime_;
    for (const auto& [id, one] : known_) result.landmarks.push_back(one);
    return result;
  }
  std::mt19937_64& random() { return random_; }

 private:
  std::mt19937_64 random_;
  model::Utime utime_ = 1000;
  std::uint64_t version_ = 0;
  std::uint64_t counter_ = 0;
  std::uint64_t submaps_ = 0;
  std::map<model::LandmarkId, model::MapLandmark> map_;
  std::map<model::LandmarkId, model::LandmarkExistence> known_;
};

TEST_CASE("updates lead to the scene that is made from scratch") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    RandomMapper mapper(seed);
    LandmarkScene scene(kEnough);
    LandmarkScene fresh(kEnough);
    model::HeldMap held;
    test::ShownScene shown;
    for (int step = 0; step < 60; ++step) {
      const model::MapDelta delta = mapper.change();
      const model::Existence existence = mapper.existence();
      scene.take(delta);
      held.take(delta);
      scene.take(existence);
      if (step % 17 == 16) {
        const model::Submap submap = mapper.submap();
        scene.take(submap);
        fresh.take(submap);
        held.take(submap);
      }
      if (step % 13 == 12) {
        scene.take(mapper.whole());
        held.take(mapper.whole());
      }
      if (step % 3 == 0) shown.take(scene.update(delta.utime));
    }
    shown.take(scene.update(2000));
    REQUIRE_FALSE(scene.has_changed());

    fresh.take(mapper.whole());
    fresh.take(mapper.all_known());
    test::ShownScene late;
    late.take(scene.whole(2000));
    REQUIRE(shown.content() == late.content());
    REQUIRE(shown.landmarks() == scene.size());
    REQUIRE(scene.size() == held.whole()->landmarks.size());
    if (seed == 0) REQUIRE(fresh.size() == scene.size());
  }
}

TEST_CASE("an existence and a whole map give the same scene in either way") {
  RandomMapper mapper(7);
  LandmarkScene scene(kEnough);
  for (int step = 0; step < 40; ++step) {
    scene.take(mapper.change());
    scene.take(mapper.existence());
    if (step % 3 == 0) scene.update(1);
  }
  LandmarkScene fresh(kEnough);
  fresh.take(mapper.whole());
  fresh.take(mapper.all_known());
  REQUIRE(fresh.whole(5) == scene.whole(5));
}

TEST_CASE("an update costs what changed") {
  std::mt19937_64 random(1);
  LandmarkScene scene(kEnough);
  model::WholeMap map;
  map.version = 1;
  for (std::uint64_t i = 1; i <= 800; ++i) map.landmarks.push_back(landmark(random, i));
  scene.take(map);
  const std::size_t all = scene.update(1).size();
  scene.take(map);
  REQUIRE_FALSE(scene.has_changed());

  model::MapDelta delta{2, 0, 1, 2, {}, {}, {}, {}};
  delta.moved.push_back(map.landmarks[400]);
  delta.moved[0].position_m.x() += 1.0;
  scene.take(delta);
  const auto update = nlohmann::json::parse(scene.update(2));
  REQUIRE(update["entities"].size() == 1);
  REQUIRE(update["deletions"].empty());
  REQUIRE(update.dump().size() * 20 < all);

  // Less than it is drawn with: nothing to tell.
  delta.base_version = 2;
  delta.version = 3;
  delta.moved[0].position_m.x() += 1e-5;
  scene.take(delta);
  REQUIRE_FALSE(scene.has_changed());
}

TEST_CASE("another map leaves nothing of the one before") {
  RandomMapper first(1);
  RandomMapper second(2);
  LandmarkScene scene(kEnough);
  test::ShownScene shown;
  for (int step = 0; step < 20; ++step) scene.take(first.change());
  shown.take(scene.update(1500));
  const model::MapDelta start = second.change();
  scene.take(start);
  shown.take(scene.update(1600));
  REQUIRE(shown.landmarks() == start.added.size());
}

TEST_CASE("landmarks beyond the bound are left out and counted") {
  std::mt19937_64 random(1);
  LandmarkScene scene(10);
  model::WholeMap map;
  for (std::uint64_t i = 1; i <= 25; ++i) map.landmarks.push_back(landmark(random, i));
  scene.take(map);
  REQUIRE(scene.size() == 10);
  REQUIRE(scene.left_out() == 15);
}

}  // namespace
}  // namespace understory::foxglove
