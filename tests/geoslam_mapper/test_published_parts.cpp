// What the service computes between the mapper and the bus, each part alone: versions and budget of
// MAP, the stream of poses, the exchange of submaps.
#include <algorithm>

#include "services/geoslam_mapper/pose_stream.hpp"
#include "services/geoslam_mapper/published_map.hpp"
#include "services/geoslam_mapper/submap_exchange.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;

namespace {

model::MapLandmark landmark(model::LandmarkId number, double x_m, std::uint32_t map_id = 1) {
  model::MapLandmark one;
  one.id = (static_cast<model::LandmarkId>(map_id) << 48U) + number;
  one.position_m = {x_m, 0.0};
  return one;
}

using Landmarks = std::vector<model::MapLandmark>;

model::MapUpdate updated(std::uint32_t map_id = 1, model::Utime utime = 1'000'000) {
  model::MapUpdate update;
  update.utime = utime;
  update.map_id = map_id;
  update.status = model::MapUpdateStatus::kUpdated;
  return update;
}

PublishedMap published() { return PublishedMap({0.001, 0.5, 0.1}); }

/// The map learns of an update; each landmark has 0.01 m^2 along each axis.
std::optional<model::MapDelta> tell(PublishedMap& map, const model::MapUpdate& update,
                                    const Landmarks& changed) {
  return map.on_update(update, changed, [](std::span<model::MapLandmark> landmarks) {
    for (model::MapLandmark& one : landmarks)
      one.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  });
}

model::Submap submap(model::SubmapId id, std::vector<model::MapLandmark> landmarks) {
  model::Submap one;
  one.id = id;
  one.content_hash = 7 * id;
  one.landmarks = std::move(landmarks);
  return one;
}

PoseStream stream() { return PoseStream({0.5, 0.05, 0.05}); }

model::Keyframe keyframe_of(std::initializer_list<model::Utime> scans) {
  model::Keyframe keyframe;
  keyframe.utime = *scans.begin();
  for (const model::Utime utime : scans)
    keyframe.members.push_back({utime, 0, {}, 1e-4 * Eigen::Matrix3d::Identity()});
  return keyframe;
}

model::LandmarkScan scan_at(model::Utime utime) {
  model::LandmarkScan scan;
  scan.utime = utime;
  return scan;
}

ScanPose place_at(double x_m) {
  return {{geometry::SE2(x_m, 0.0, 0.0), 0.01 * Eigen::Matrix3d::Identity()}, false};
}

}  // namespace

TEST_CASE("a published map numbers its versions and tells changes alone", "[published]") {
  Landmarks held;
  PublishedMap map = published();
  CHECK(map.map_id() == 0);
  CHECK_FALSE(map.has_changed());

  held = {landmark(1, 0.0), landmark(2, 5.0)};
  const auto first = tell(map, updated(), held);
  REQUIRE(first);
  CHECK(first->base_version == 0);
  CHECK(first->version == 1);
  CHECK(first->added.size() == 2);
  CHECK(map.is_due());  // The map started.
  map.sent(100);
  CHECK_FALSE(map.has_changed());

  CHECK_FALSE(tell(map, updated(), held));
  CHECK(map.has_changed());  // By less than is told.
  held.push_back(landmark(3, 9.0));
  const auto second = tell(map, updated(), held);
  REQUIRE(second);
  CHECK(second->base_version == 1);
  CHECK(second->version == 2);
  CHECK(second->added.size() == 1);
  CHECK(second->added.front().covariance_m2(0, 0) == Approx(0.01));
  CHECK(map.whole(held, {}).version == 2);
  CHECK(map.whole(held, {}).landmarks.size() == 3);
}

TEST_CASE("MAP without a request stays within its share, but for one that is due", "[published]") {
  Landmarks held;
  PublishedMap map = published();
  held = {landmark(1, 0.0)};
  tell(map, updated(), held);
  CHECK(map.is_due());
  const std::size_t bytes = map_bytes(1, 1);
  map.sent(bytes);  // Borrowed.

  tell(map, updated(), held);
  CHECK_FALSE(map.is_due());
  map.earn(9 * bytes);  // Pays what was borrowed.
  CHECK_FALSE(map.is_due());
  map.earn(9 * map_bytes(1, 2) + 9);
  CHECK(map.is_due());

  // A jump of most of the map is due while nothing is owed.
  map.sent(map_bytes(1, 2));
  held.front().position_m.x() += 1.0;
  tell(map, updated(), held);
  CHECK(map.is_due());
}

TEST_CASE("another map builds on nothing, and versions go on", "[published]") {
  Landmarks held;
  PublishedMap map = published();
  held = {landmark(1, 0.0)};
  tell(map, updated(1), held);
  CHECK_FALSE(map.is_another(updated(1)));
  CHECK(map.is_another(updated(2)));

  held = {landmark(1, 3.0, 2)};
  const auto delta = tell(map, updated(2), held);
  REQUIRE(delta);
  CHECK(map.map_id() == 2);
  CHECK(delta->base_version == 0);
  CHECK(delta->version == 2);
  CHECK(delta->removed.empty());
  CHECK(map.landmarks().size() == 1);
}

TEST_CASE("a given map is due at once and has the number of its landmarks", "[published]") {
  Landmarks held;
  PublishedMap map = published();
  map.begin_with({landmark(4, 0.0, 9)});
  CHECK(map.map_id() == 9);
  CHECK(map.is_due());
  held = {landmark(4, 0.0, 9)};
  CHECK_FALSE(tell(map, updated(9), held));
}

TEST_CASE("a published map goes on after a restart as it would have", "[published]") {
  Landmarks held;
  PublishedMap map = published();
  held = {landmark(1, 0.0), landmark(2, 5.0)};
  tell(map, updated(), held);
  map.sent(1000);
  map.earn(500);
  PublishedMap loaded = published();
  state::load(state::save({"test"}, map), {"test"}, loaded);
  held.push_back(landmark(3, 9.0));
  const auto a = tell(map, updated(), held), b = tell(loaded, updated(), held);
  REQUIRE((a && b));
  CHECK(a->version == b->version);
  CHECK(map.is_due() == loaded.is_due());
  CHECK(state::save({"test"}, map) == state::save({"test"}, loaded));
}

TEST_CASE("poses are published once, in order of time, and counted once", "[published]") {
  PoseStream poses = stream();
  CHECK(poses.on_scan(scan_at(100), place_at(1.0), 1));
  CHECK_FALSE(poses.on_scan(scan_at(100), place_at(1.0), 1));
  CHECK_FALSE(poses.on_scan(scan_at(200), std::nullopt, 1));

  // The scan at 100 has its pose; all three count now.
  auto made = poses.on_keyframe(keyframe_of({100, 200, 300}), updated(), false);
  CHECK(made.counted == 3);
  REQUIRE(made.poses.size() == 2);
  CHECK(made.poses.front().utime == 200);
  // Keyframes may share scans.
  made = poses.on_keyframe(keyframe_of({300, 400}), updated(), true);
  CHECK(made.counted == 1);
  REQUIRE(made.poses.size() == 1);
  CHECK(made.poses.front().is_new_map);
}

TEST_CASE("a keyframe's old scans have no pose", "[published]") {
  constexpr model::Utime kSecond = 1'000'000;
  PoseStream poses = stream();
  CHECK_FALSE(poses.on_scan(scan_at(5 * kSecond), std::nullopt, 0));
  const auto made = poses.on_keyframe(keyframe_of({kSecond, 5 * kSecond - 10}), updated(), false);
  REQUIRE(made.poses.size() == 1);
  CHECK(made.poses.front().utime == 5 * kSecond - 10);
  CHECK(made.counted == 2);
}

TEST_CASE("a pose has the odometry's frame, the jumps so far and the given map's error",
          "[published]") {
  PoseStream poses = stream();
  model::Odometry motion;
  motion.utime = 100;
  motion.from_T_to = geometry::SE2(2.0, 0.0, 0.0);
  poses.on_odometry(motion);
  poses.begin_behind(40);
  const auto pose = poses.on_scan(scan_at(100), place_at(7.0), 0);
  REQUIRE(pose);
  CHECK(pose->map_id == 1);  // Before the first keyframe: the map that will be.
  CHECK(pose->map_T_odom.x() == Approx(5.0));
  CHECK(pose->reset_counter == 40);
  CHECK(pose->covariance(0, 0) == Approx(0.01));

  model::WholeMap given;
  given.landmarks = {landmark(1, 0.0, 3)};
  given.keyframes.push_back({});
  given.keyframes.back().covariance = 0.25 * Eigen::Matrix3d::Identity();
  poses.begin_in(given);
  CHECK(poses.given_covariance_at({}, 3)(0, 0) == Approx(0.25));
  CHECK(poses.given_covariance_at({}, 2).isZero(0.0));
}

TEST_CASE("no message has landmarks of a submap that was given away", "[published]") {
  Landmarks held{landmark(1, 0.0), landmark(2, 5.0)};
  PublishedMap map = published();
  tell(map, updated(), held);
  map.give_away(submap(1, {held.back()}));
  held.pop_back();
  CHECK(map.landmarks().size() == 1);
  CHECK_FALSE(tell(map, updated(), held));  // Nor by the next keyframe.
}

TEST_CASE("a submap is sent again until the store has it, and stops the mapper where none does",
          "[published]") {
  SubmapExchange exchange;
  CHECK(exchange.on_keyframe(0, {submap(1, {})}, {}, 1).submaps.size() == 1);
  CHECK(exchange.on_keyframe(500'000, {}, {}, 1).submaps.empty());
  CHECK(exchange.on_keyframe(1'000'000, {}, {}, 1).submaps.size() == 1);
  exchange.on_stored({0, 0, 1, 1, 7});
  CHECK(exchange.on_keyframe(2'000'000, {}, {}, 1).submaps.empty());
  CHECK(exchange.keeps_up());

  std::vector<model::Submap> given_away;
  for (model::SubmapId id = 2; id < 2 + HandOver::kMostWaiting; ++id)
    given_away.push_back(submap(id, {}));
  exchange.on_keyframe(3'000'000, given_away, {}, 1);
  CHECK_FALSE(exchange.keeps_up());
  exchange.on_stored({0, 0, 1, 2, 14});
  CHECK(exchange.keeps_up());
}

TEST_CASE("a wanted submap comes from what waits, else the store is asked", "[published]") {
  SubmapExchange exchange;
  exchange.on_keyframe(0, {submap(1, {})}, {}, 1);

  const auto messages = exchange.on_keyframe(100'000, {}, {1, 8}, 1);
  REQUIRE(messages.waited.size() == 1);
  CHECK(messages.waited.front().id == 1);
  CHECK(messages.query.ids == std::vector<model::SubmapId>{8});
  const auto next = exchange.on_keyframe(2'000'000, {}, {8}, 1);
  CHECK(next.submaps.empty());  // It does not wait any more.
  CHECK(next.waited.empty());
}

TEST_CASE("poses of submaps are sent where one moved, every ten seconds and at the end",
          "[published]") {
  PublishedMap map = published();
  tell(map, updated(), {});
  SubmapExchange exchange;
  std::vector<model::SubmapPose> places{{4, geometry::SE2(1.0, 0.0, 0.0)}};
  CHECK_FALSE(exchange.is_correction_due(9'000'000));
  REQUIRE(exchange.is_correction_due(10'000'000));
  const auto first = exchange.correction(places, map, false);
  REQUIRE(first);
  CHECK(first->version == 1);
  CHECK(first->submaps.size() == 1);

  places.front().map_T_submap = geometry::SE2(1.01, 0.0, 0.0);  // Less than matters.
  CHECK_FALSE(exchange.correction(places, map, false));
  const auto last = exchange.correction(places, map, true);
  REQUIRE(last);
  CHECK(last->version == 2);
}
