// What the mapper publishes beyond the stage: differences of maps, the odometry frame, poses,
// jumps.
#include <Eigen/LU>
#include <numbers>
#include <random>
#include <set>

#include "common/model/held_map.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "services/geoslam_mapper/pose_publishing.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;

namespace {

geometry::SE2 random_pose(std::mt19937_64& random, double spread_m = 5.0) {
  std::uniform_real_distribution<double> coordinate(-spread_m, spread_m);
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  const double x = coordinate(random);
  const double y = coordinate(random);
  return {x, y, angle(random)};
}

double difference(const geometry::SE2& a, const geometry::SE2& b) {
  return (a.inverse() * b).Log().norm();
}

model::MapLandmark landmark(model::LandmarkId id, std::mt19937_64& random) {
  model::MapLandmark one;
  one.id = id;
  one.position_m = random_pose(random).translation();
  one.observation_count = static_cast<std::uint32_t>(random() % 100);
  return one;
}

/// A map and what became of it: some stay, move a little or far, go, are merged, or come.
struct ChangedMap {
  std::vector<model::MapLandmark> before;
  std::vector<model::MapLandmark> after;
  model::MapUpdate update;

  explicit ChangedMap(std::mt19937_64& random, double moved_m) {
    for (model::LandmarkId id = 1; id <= 60; ++id) {
      const auto fate = random() % 6;
      model::MapLandmark one = landmark(id, random);
      if (fate != 0) before.push_back(one);
      if (fate == 1) {
        update.removed.push_back(id);
        continue;
      }
      if (fate == 2 && !after.empty()) {
        update.merged.emplace_back(id, after.back().id);
        continue;
      }
      if (fate == 3) one.position_m.x() += 0.5 * moved_m;
      if (fate == 4) one.position_m.y() -= 3.0 * moved_m;
      after.push_back(one);
    }
  }
};

/// The bytes of one value's saved state.
template <class T>
std::string saved(const T& value) {
  return state::save({"test"}, value);
}
template <class T>
void load(const std::string& bytes, T& value) {
  state::load(bytes, {"test"}, value);
}

std::set<model::LandmarkId> ids_of(const std::vector<model::MapLandmark>& landmarks) {
  std::set<model::LandmarkId> ids;
  for (const auto& one : landmarks) ids.insert(one.id);
  return ids;
}

/// A keyframe of `size` scans, 0.1 s apart, with random member poses.
model::Keyframe random_keyframe(std::mt19937_64& random, std::size_t size) {
  model::Keyframe keyframe;
  keyframe.sequence = 7;
  keyframe.utime = 1000000;
  for (std::size_t i = 0; i < size; ++i) {
    model::KeyframeMember member;
    member.utime = keyframe.utime + 100000 * static_cast<model::Utime>(i);
    member.centre_T_vehicle = random_pose(random);
    member.covariance = 0.01 * Eigen::Matrix3d::Identity();
    keyframe.members.push_back(member);
  }
  return keyframe;
}

model::MapUpdate updated_at(const geometry::SE2& pose) {
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kUpdated;
  update.map_T_vehicle = pose;
  update.covariance = 0.04 * Eigen::Matrix3d::Identity();
  update.map_T_latest_vehicle = pose;
  return update;
}

}  // namespace

TEST_CASE("a holder of every difference has the map", "[map_publishing]") {
  constexpr double kMoved = 0.01;
  std::mt19937_64 random(1);
  for (int run = 0; run < 200; ++run) {
    const ChangedMap map(random, kMoved);
    const model::MapDelta delta = map_change(map.before, map.after, map.update, {kMoved, {}});
    const auto held = with_delta(map.before, delta);
    REQUIRE(held.size() == map.after.size());
    for (std::size_t i = 0; i < held.size(); ++i) {
      CHECK(held[i].id == map.after[i].id);
      CHECK((held[i].position_m - map.after[i].position_m).norm() <= kMoved);
    }
  }
}

TEST_CASE("a difference holds no more than what changed", "[map_publishing]") {
  constexpr double kMoved = 0.01;
  std::mt19937_64 random(2);
  for (int run = 0; run < 200; ++run) {
    const ChangedMap map(random, kMoved);
    const model::MapDelta delta = map_change(map.before, map.after, map.update, {kMoved, {}});
    const auto before = ids_of(map.before);
    const auto after = ids_of(map.after);
    for (const auto& one : delta.added) CHECK_FALSE(before.contains(one.id));
    for (const auto& one : delta.moved) CHECK(before.contains(one.id));
    for (const model::LandmarkId id : delta.removed) {
      CHECK(before.contains(id));
      CHECK_FALSE(after.contains(id));
      for (const auto& [old_id, new_id] : delta.merged) CHECK(old_id != id);
    }
    const auto nothing = map_change(map.after, map.after, {}, {kMoved, {}});
    CHECK(nothing.added.empty());
    CHECK(nothing.moved.empty());
    CHECK(nothing.removed.empty());
  }
}

TEST_CASE("small steps add up until they are reported", "[map_publishing]") {
  std::mt19937_64 random(3);
  std::vector<model::MapLandmark> map{landmark(1, random)};
  std::vector<model::MapLandmark> held = map;
  int reported = 0;
  for (int step = 0; step < 100; ++step) {
    map[0].position_m.x() += 0.004;
    const model::MapDelta delta = map_change(held, map, {}, {0.01, {}});
    reported += static_cast<int>(delta.moved.size());
    held = with_delta(held, delta);
    CHECK((held[0].position_m - map[0].position_m).norm() <= 0.01);
  }
  CHECK(reported == 33);  // At every third step of 4 mm.
}

TEST_CASE("the odometry frame is the sum of the motions", "[map_publishing]") {
  std::mt19937_64 random(4);
  OdometryFrame frame;
  CHECK(difference(frame.odom_T_vehicle(5), geometry::SE2()) == 0.0);
  std::vector<geometry::SE2> poses{geometry::SE2()};

  for (int i = 0; i < 300; ++i) {
    model::Odometry motion;
    motion.from_utime = 1000 + 100 * static_cast<model::Utime>(i);
    motion.utime = motion.from_utime + 100;
    motion.from_T_to = random_pose(random, 0.5);
    frame.add(motion);
    poses.push_back(poses.back() * motion.from_T_to);
  }

  OdometryFrame loaded;
  load(saved(frame), loaded);

  for (std::size_t i = 0; i < poses.size(); ++i) {
    const model::Utime utime = 1000 + 100 * static_cast<model::Utime>(i);
    CHECK(difference(frame.odom_T_vehicle(utime), poses[i]) < 1e-9);
    CHECK(difference(frame.odom_T_vehicle(utime + 99), poses[i]) < 1e-9);
    CHECK(difference(loaded.odom_T_vehicle(utime), frame.odom_T_vehicle(utime)) == 0.0);
  }

  CHECK(difference(frame.odom_T_vehicle(0), poses.front()) < 1e-9);
  CHECK(saved(loaded) == saved(frame));
}

TEST_CASE("states that are not whole are refused", "[map_publishing]") {
  OdometryFrame frame;
  frame.add(model::Odometry{});
  const std::string state = saved(frame);
  OdometryFrame other;
  CHECK_THROWS_AS(load("", other), std::invalid_argument);
  CHECK_THROWS_AS(load(state.substr(0, state.size() - 1), other), std::invalid_argument);
  CHECK_THROWS_AS(load(state + "x", other), std::invalid_argument);
  JumpWatch watch;
  CHECK_THROWS_AS(load("", watch), std::invalid_argument);
  CHECK_THROWS_AS(load(state, watch), std::invalid_argument);
}

TEST_CASE("every scan of a keyframe has its pose, known no better than the keyframe's",
          "[map_publishing]") {
  std::mt19937_64 random(5);
  for (int run = 0; run < 50; ++run) {
    const model::Keyframe keyframe = random_keyframe(random, 8);
    model::MapUpdate update = updated_at(random_pose(random));
    update.map_T_latest_vehicle = random_pose(random);
    const auto poses = poses_of(keyframe, update);
    REQUIRE(poses.size() == keyframe.members.size());
    // The keyframe's centre in the map, by the base alone.
    const geometry::SE2 map_T_centre = update.map_T_vehicle * keyframe.centre_T_base().inverse();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      CHECK(poses[i].utime == keyframe.members[i].utime);
      CHECK(poses[i].keyframe_sequence == keyframe.sequence);
      const geometry::SE2 expected = i + 1 == poses.size()
                                         ? update.map_T_latest_vehicle
                                         : map_T_centre * keyframe.members[i].centre_T_vehicle;
      CHECK(difference(poses[i].map_T_vehicle(), expected) < 1e-9);
      CHECK(poses[i].covariance.determinant() >= update.covariance.determinant() * (1.0 - 1e-9));
    }
    CHECK((poses.front().covariance - update.covariance).norm() < 1e-12);
  }
}

TEST_CASE("a keyframe without a place gives one pose with its status", "[map_publishing]") {
  std::mt19937_64 random(6);
  const model::Keyframe keyframe = random_keyframe(random, 8);
  for (const auto status :
       {model::MapUpdateStatus::kNotSure, model::MapUpdateStatus::kRolledBack}) {
    model::MapUpdate update;
    update.status = status;
    const auto poses = poses_of(keyframe, update);
    REQUIRE(poses.size() == 1);
    CHECK(poses[0].utime == keyframe.members.back().utime);
    CHECK(poses[0].status == status);
    CHECK_FALSE(poses[0].is_localised());
  }
}

TEST_CASE("a jump against what was tracked is counted, a tracked motion is none",
          "[map_publishing]") {
  std::mt19937_64 random(7);
  JumpWatch watch(0.5, 0.05);
  geometry::SE2 pose;
  const auto step = [&](const geometry::SE2& tracked, const geometry::SE2& jump,
                        model::MapUpdateStatus status) {
    model::Keyframe keyframe = random_keyframe(random, 2);
    keyframe.previous_T_base = tracked;
    pose = pose * tracked * jump;
    model::MapUpdate update = updated_at(pose);
    update.status = status;
    watch.add(keyframe, update);
  };

  step(geometry::SE2(), geometry::SE2(), model::MapUpdateStatus::kFirstMap);

  for (int i = 0; i < 20; ++i)
    step(random_pose(random), {0.1, 0.1, 0.01}, model::MapUpdateStatus::kUpdated);
  CHECK(watch.count() == 0);
  step(random_pose(random), {0.6, 0.0, 0.0}, model::MapUpdateStatus::kUpdated);
  CHECK(watch.count() == 1);
  CHECK(difference(watch.delta(), {0.6, 0.0, 0.0}) < 1e-9);

  // Through a keyframe without a place the prediction goes on.
  step(random_pose(random), geometry::SE2(), model::MapUpdateStatus::kNotSure);
  JumpWatch loaded(0.5, 0.05);
  load(saved(watch), loaded);
  CHECK(saved(loaded) == saved(watch));
  step(random_pose(random), {0.0, 0.0, -0.06}, model::MapUpdateStatus::kUpdated);
  CHECK(watch.count() == 2);
  CHECK(watch.delta().theta() == Approx(-0.06));
}

TEST_CASE("where tracking broke off there is nothing to jump from", "[map_publishing]") {
  std::mt19937_64 random(8);
  JumpWatch watch;
  for (int i = 0; i < 10; ++i) {
    watch.add(random_keyframe(random, 2), updated_at(random_pose(random, 100.0)));
  }
  CHECK(watch.count() == 0);
}

TEST_CASE("a change of the map is a jump of which nothing is known", "[map_publishing]") {
  std::mt19937_64 random(9);
  JumpWatch watch;
  geometry::SE2 pose;
  for (int i = 0; i < 30; ++i) {
    model::Keyframe keyframe = random_keyframe(random, 2);
    keyframe.previous_T_base = random_pose(random);
    pose = i % 10 == 0 ? random_pose(random, 100.0) : pose * *keyframe.previous_T_base;
    model::MapUpdate update = updated_at(pose);
    update.map_id = 1 + static_cast<std::uint32_t>(i) / 10;
    if (i % 10 == 0) update.status = model::MapUpdateStatus::kFirstMap;
    watch.add(keyframe, update);
    CHECK(watch.count() == update.map_id - 1);
    CHECK(difference(watch.delta(), geometry::SE2()) == 0.0);
  }
}

TEST_CASE("A subscriber is within a quarter of the stated sigma, and 2 or 10 cm",
          "[map_publishing]") {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> sigma(0.0, 0.6);
  std::uniform_real_distribution<double> place(-120.0, 120.0);
  std::normal_distribution<double> step;
  std::vector<model::MapLandmark> told(200);
  for (std::size_t i = 0; i < told.size(); ++i) {
    told[i].id = i + 1;
    told[i].position_m = {place(random), place(random)};
    told[i].covariance_m2 = std::pow(sigma(random), 2) * Eigen::Matrix2d::Identity();
  }

  // Many small steps, and a vehicle that comes near: what is left out does not add up.
  std::vector<model::MapLandmark> now = told;
  std::size_t listed = 0;
  for (int round = 0; round < 200; ++round) {
    for (model::MapLandmark& one : now)
      one.position_m += 0.002 * Eigen::Vector2d(step(random), step(random));
    const MapTolerance tolerance{0.001, {round - 100.0, 0.0}};
    const model::MapDelta delta = map_change(told, now, {}, tolerance);
    listed += delta.moved.size();
    told = model::with_delta(std::move(told), delta);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const bool is_near = (now[i].position_m - tolerance.vehicle_m).norm() < 60.0;
      const double sigma_m = std::sqrt(told[i].covariance_m2(0, 0));
      const double off_m = (told[i].position_m - now[i].position_m).norm();
      CHECK(off_m <= std::max(0.001, std::min(is_near ? 0.02 : 0.10, 0.25 * sigma_m)) + 1e-12);
    }
  }
  CHECK(listed < 200 * now.size() / 4);
}
