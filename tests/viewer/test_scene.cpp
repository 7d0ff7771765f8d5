#include <random>

#include "services/viewer/process_watch.hpp"
#include "services/viewer/scene.hpp"
#include "tests/catch.hpp"

namespace understory {
namespace {

using Catch::Matchers::Contains;
using viewer::Scene;
using viewer::Verdict;

model::MapLandmark landmark(model::LandmarkId id, double x, double y) {
  model::MapLandmark one;
  one.id = id;
  one.position_m = {x, y};
  return one;
}

model::SlamPose pose(model::Utime utime, double x = 0.0) {
  model::SlamPose one;
  one.utime = utime;
  one.submap_T_vehicle = {x, 0.0, 0.0};
  one.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  return one;
}

}  // namespace

TEST_CASE("what is handed over stays on the map and follows corrections", "[viewer]") {
  Scene scene;
  model::MapDelta first;
  first.version = 1;
  first.added = {landmark(1, 0, 0), landmark(2, 10, 0), landmark(3, 0, 10), landmark(4, 50, 0)};
  scene.take(first);

  model::Submap submap;
  submap.id = 9;
  submap.map_T_submap = {10.0, 0.0, 0.5 * M_PI};
  for (const auto& one : {first.added[0], first.added[1], first.added[2]}) {
    submap.landmarks.push_back(one);
    submap.landmarks.back().position_m = submap.map_T_submap.inverse() * one.position_m;
  }
  submap.keyframes = {{5, 100, submap.map_T_submap.inverse() * geometry::SE2(1.0, 1.0, 0.0),
                       Eigen::Matrix3d::Zero()}};
  scene.take(submap);
  scene.take(submap);  // Sent again until it is stored.
  CHECK(scene.submaps().places().at(9).outline_m.size() == 3);
  CHECK(scene.landmarks().size() == 4);

  // A whole map without them does not take them out.
  model::WholeMap rest;
  rest.version = 2;
  rest.landmarks = {landmark(4, 50, 0)};
  rest.keyframes = {{5, 100, {1.0, 1.0, 0.0}, Eigen::Matrix3d::Zero()}};
  scene.take(rest);
  CHECK(scene.landmarks().size() == 4);

  model::MapCorrection correction;
  correction.submaps = {{9, geometry::SE2(20.0, 0.0, 0.5 * M_PI)}};
  scene.take(correction);
  CHECK(scene.landmarks().find(1)->x_m == Approx(10.0));
  CHECK(scene.landmarks().find(4)->x_m == Approx(50.0));
  CHECK(scene.keyframes().points()[0].x_m == Approx(11.0));

  // Back with the mapper, which moves it itself from now on.
  model::MapDelta back;
  back.base_version = 2;
  back.version = 3;
  back.moved = {landmark(1, 7, 7)};
  scene.take(back);
  correction.submaps = {{9, geometry::SE2(30.0, 0.0, 0.5 * M_PI)}};
  scene.take(correction);
  CHECK(scene.landmarks().find(1)->x_m == Approx(7.0));
  CHECK(scene.landmarks().find(2)->x_m == Approx(30.0));
}

TEST_CASE("the verdict is what the pose says, and silence", "[viewer]") {
  Scene scene;
  scene.look(1'000'000);
  CHECK(scene.verdict().value.state == Verdict::State::kWaiting);

  scene.take(pose(100), 1'000'000);
  CHECK(scene.verdict().value.state == Verdict::State::kOk);
  CHECK_THAT(scene.verdict().value.text, Contains("localised, \u00b10.03 m"));

  model::SlamPose one = pose(200);
  one.is_coasting = true;
  scene.take(one, 1'100'000);
  CHECK(scene.verdict().value.state == Verdict::State::kUnsure);
  one = pose(300);
  one.covariance(0, 0) = 9.0;
  scene.take(one, 1'200'000);
  CHECK(scene.verdict().value.state == Verdict::State::kUnsure);
  CHECK(scene.verdict().value.since_utime == 200);

  one = pose(400);
  one.status = model::MapUpdateStatus::kNotSure;
  one.is_lost = true;
  scene.take(one, 1'300'000);
  CHECK(scene.verdict().value.state == Verdict::State::kLost);
  CHECK(scene.driven().points().back().utime == 300);  // A pose without meaning is not drawn.

  scene.look(2'200'000);
  CHECK(scene.verdict().value.state == Verdict::State::kLost);
  scene.look(2'400'000);
  CHECK(scene.verdict().value.state == Verdict::State::kSilent);
  scene.take(pose(500), 2'500'000);
  CHECK(scene.verdict().value.state == Verdict::State::kOk);
}

TEST_CASE("another map begins a page of its own", "[viewer]") {
  Scene scene;
  scene.take(pose(100), 1);
  model::MapDelta delta;
  delta.version = 1;
  delta.added = {landmark(1, 0, 0)};
  scene.take(delta);
  const auto before = scene.reset_change();
  model::SlamPose other = pose(200);
  other.map_id = 2;
  scene.take(other, 2);
  CHECK(scene.reset_change() > before);
  CHECK(scene.landmarks().size() == 0);
  CHECK(scene.driven().points().size() == 1);
}

TEST_CASE("a process that ended or says nothing is silent", "[viewer]") {
  Scene scene;
  health_t health{};
  health.process = "ekf";
  health.state = health_t::STATE_OK;
  scene.take(health, 1'000'000);
  const auto silent = [&] { return scene.processes().entries().at("ekf").is_silent; };
  scene.look(2'400'000);
  CHECK_FALSE(silent());
  scene.look(2'600'000);
  CHECK(silent());

  scene.take(health, 3'000'000);
  scene.look(3'010'000);
  CHECK_FALSE(silent());
  // The kernel knows it at once.
  scene.processes().take("ekf", {.is_running = false}, 3'020'000);
  scene.look(3'020'000);
  CHECK(silent());
  scene.take(health, 3'100'000);
  scene.look(3'110'000);
  CHECK_FALSE(silent());

  CHECK(viewer::look_at_process(::getpid()).is_running);
  CHECK_FALSE(viewer::look_at_process(0x7fffffff).is_running);
}

TEST_CASE("the error to ground truth does not depend on the world's frame", "[viewer]") {
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 0.02);
  const geometry::SE2 world_T_map(500.0, -300.0, 2.0);
  Scene scene;
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < 400; ++i) {
    const geometry::SE2 map_T_vehicle(0.3 * i, 10.0 * std::sin(0.05 * i), 0.02 * i);
    const model::Utime utime = 100'000 * (i + 1);
    scene.take_truth(utime, world_T_map * map_T_vehicle);
    model::SlamPose one = pose(utime);
    one.submap_T_vehicle = {map_T_vehicle.x() + noise(random), map_T_vehicle.y() + noise(random),
                            map_T_vehicle.theta()};
    one.covariance = Eigen::Vector3d(4e-4, 4e-4, 1e-6).asDiagonal();
    scene.take(one, utime);
    if (i < 100 || !scene.numbers().value.nees) continue;
    sum += *scene.numbers().value.nees;
    ++count;
  }
  // Two of the three dimensions have noise.
  CHECK(count == 300);
  CHECK(sum / count == Approx(2.0).margin(0.4));
  CHECK(*scene.numbers().value.error_m < 0.1);
  REQUIRE(scene.truth().points().size() > 300);
  CHECK(scene.truth().points()[100].x_m == Approx(30.0).margin(0.5));
}

TEST_CASE("truth is tied where the map begins", "[viewer]") {
  const geometry::SE2 world_T_map(50.0, 20.0, 1.0);
  Scene scene;
  for (int i = 0; i <= 20; ++i)
    scene.take_truth(100'000 * i, world_T_map * geometry::SE2(0.05 * i, 0.0, 0.0));
  model::MapUpdate first;
  first.status = model::MapUpdateStatus::kFirstMap;
  first.utime = 1'000'000;
  first.map_T_vehicle = {0.5, 0.0, 0.0};
  scene.take(first);
  // A heading that is wrong from there on is an error; the best alignment would hide it.
  for (int i = 21; i <= 400; ++i) {
    scene.take_truth(100'000 * i, world_T_map * geometry::SE2(0.05 * i, 0.0, 0.0));
    model::SlamPose one = pose(100'000 * i);
    one.submap_T_vehicle = {0.05 * i, 0.001 * 0.05 * i, 0.001};
    scene.take(one, 100'000 * i);
  }
  CHECK(*scene.numbers().value.error_m == Approx(0.02).margin(0.002));
  CHECK(*scene.numbers().value.error_rad == Approx(0.001).margin(1e-4));
}

TEST_CASE("a pose that is farther from ground truth than it says is not ok", "[viewer]") {
  Scene scene;
  scene.take_truth(0, geometry::SE2());
  model::MapUpdate first;
  first.status = model::MapUpdateStatus::kFirstMap;
  scene.take(first);
  // The standard deviation of a pose is 0.01 m.
  model::Utime utime = 0;
  const auto state_at = [&](double error_m) {
    utime += 100'000;
    scene.take_truth(utime, geometry::SE2(1e-6 * static_cast<double>(utime), error_m, 0.0));
    scene.take(pose(utime, 1e-6 * static_cast<double>(utime)), utime);
    return scene.verdict().value.state;
  };
  CHECK(state_at(0.02) == Verdict::State::kOk);
  CHECK(state_at(0.04) == Verdict::State::kOk);  // NEES 16.0: one in a thousand.
  CHECK(state_at(0.06) == Verdict::State::kUnsure);
  CHECK_THAT(scene.verdict().value.text, Contains("\u00b10.03 m is too small: NEES 36"));

  // It ends within the bounds that the page draws.
  CHECK(state_at(0.035) == Verdict::State::kUnsure);
  CHECK(state_at(0.03) == Verdict::State::kOk);

  // In another map nothing is known of it.
  CHECK(state_at(0.06) == Verdict::State::kUnsure);
  model::SlamPose other = pose(utime + 100'000);
  other.map_id = 2;
  scene.take(other, utime + 100'000);
  CHECK(scene.verdict().value.state == Verdict::State::kOk);
  CHECK_FALSE(scene.numbers().value.nees);
}

TEST_CASE("where the best fit ties a map to the world, NEES is shown and does not judge",
          "[viewer]") {
  Scene scene;
  double most = 0.0;
  for (int i = 1; i <= 400; ++i) {
    const model::Utime utime = 100'000 * i;
    // A given map that is bent: no rigid motion brings it onto the truth.
    const geometry::SE2 truth(0.3 * i, 2e-4 * i * i, 4e-4 * i / 0.3);
    scene.take_truth(utime, truth);
    scene.take(pose(utime, 0.3 * i), utime);
    most = std::max(most, scene.numbers().value.nees.value_or(0.0));
    CHECK(scene.verdict().value.state == Verdict::State::kOk);
  }
  CHECK(most > 100.0);
}

TEST_CASE("poses that come slowly are silent when they are late", "[viewer]") {
  constexpr std::int64_t kSecond_us = 1'000'000;
  Scene scene;
  for (int i = 1; i <= 4; ++i) scene.take(pose(3 * kSecond_us * i), 3 * kSecond_us * i);
  scene.look(20 * kSecond_us);
  CHECK(scene.verdict().value.state == Verdict::State::kOk);
  scene.look(22 * kSecond_us);
  CHECK(scene.verdict().value.state == Verdict::State::kSilent);

  // A gap does not say how often they come.
  scene.take(pose(500 * kSecond_us), 500 * kSecond_us);
  scene.look(500 * kSecond_us + 900'000);
  CHECK(scene.verdict().value.state == Verdict::State::kOk);
  scene.look(502 * kSecond_us);
  CHECK(scene.verdict().value.state == Verdict::State::kSilent);

  // None that is slower than one in 3.3 s is waited for longer than 10 s.
  for (int i = 0; i < 3; ++i)
    scene.take(pose((600 + 8 * i) * kSecond_us), (600 + 8 * i) * kSecond_us);
  scene.look(627 * kSecond_us);
  CHECK(scene.verdict().value.state == Verdict::State::kSilent);
}

TEST_CASE("a map that begins is drawn from its first pose on, whatever its number", "[viewer]") {
  const std::uint32_t second = GENERATE(1U, 2U);
  Scene scene;
  for (int i = 0; i <= 40; ++i)
    scene.take_truth(100'000 * i, geometry::SE2(5.0 + 0.3 * i, 7.0, 0.0));
  const auto start = [&](std::uint32_t map_id, model::Utime utime) {
    model::MapUpdate first;
    first.status = model::MapUpdateStatus::kFirstMap;
    first.map_id = map_id;
    first.utime = utime;
    scene.take(first);
    model::SlamPose one = pose(utime);
    one.map_id = map_id;
    scene.take(one, utime);
    model::MapDelta delta;
    delta.version = 100 + static_cast<std::uint64_t>(utime);
    delta.added = {landmark(map_id, 1.0, 1.0)};
    scene.take(delta);
  };
  start(1, 1'000'000);
  start(second, 2'000'000);
  CHECK(scene.landmarks().size() == 1);
  CHECK(scene.driven().points().size() == 1);
  REQUIRE(scene.numbers().value.error_m);
  CHECK(*scene.numbers().value.error_m < 1e-9);
  CHECK(scene.keyframes().points().size() == 1);
}

TEST_CASE("latency is told from the youngest stamps, whatever the clock of the stamps",
          "[viewer]") {
  Scene scene;
  for (int i = 1; i < 100; ++i) {
    const std::int64_t stamp_us = 100'000 * i;
    const std::int64_t wall_us = 1'700'000'000'000'000 + stamp_us;
    scene.take_stamp(stamp_us, wall_us + 2'000 + 10 * (i % 7));
    scene.take(pose(stamp_us), wall_us + 42'000);
  }
  CHECK(*scene.numbers().value.latency_ms == Approx(40.0).margin(0.1));
  CHECK(*scene.numbers().value.rate_hz == Approx(10.0).margin(0.1));
}

TEST_CASE("a closure is where its ends are, and what became of it", "[viewer]") {
  Scene scene;
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  for (std::uint64_t k : {3, 8}) {
    update.keyframe_sequence = k;
    update.map_T_vehicle = {static_cast<double>(k), 1.0, 0.0};
    scene.take(update);
    update.status = model::MapUpdateStatus::kUpdated;
  }
  model::LoopClosure closure;
  closure.id = 1;
  closure.from.keyframe = 3;
  closure.to.keyframe = 8;
  scene.take(closure);
  CHECK(scene.closures().at(1).status == "sent");
  CHECK(scene.place_of(closure.to)->x() == Approx(8.0));
  CHECK_FALSE(scene.place_of({.submap = 5}));
  model::LoopResult result;
  result.closure_id = 1;
  result.status = model::LoopResult::Status::kRefused;
  result.reason = "contradicts";
  scene.take(result);
  CHECK(scene.closures().at(1).status == "refused");
  closure.is_revoked = true;
  scene.take(closure);
  CHECK(scene.closures().at(1).status == "revoked");
}

TEST_CASE("a path has the newest pose, and behind it no more points than are seen", "[viewer]") {
  Scene scene;
  // 10 Hz: a minute at 0.5 m/s, a minute at a stand.
  for (int i = 1; i <= 1200; ++i) {
    scene.take(pose(100'000 * i, std::min(30.0, 0.05 * i)), 100'000 * i);
    REQUIRE(scene.driven().points().back().utime == 100'000 * i);
  }
  CHECK(scene.driven().points().size() > 100);
  CHECK(scene.driven().points().size() < 150);
  const std::size_t before = scene.driven().points().size();
  for (int i = 1201; i <= 1300; ++i) scene.take(pose(100'000 * i, 1.5 * i), 100'000 * i);
  CHECK(scene.driven().points().size() == before + 100);
}

TEST_CASE("a reader who is far behind gets more than it lacks, never less", "[viewer]") {
  viewer::Change changes = 0;
  viewer::Track track(changes);
  track.append({});
  const viewer::TrackCursor behind{changes, 1};
  for (int i = 0; i < 5000; ++i) {
    track.replace_last({i, 1.0F, 0, 0, 0, 0});
    track.append({i, 2.0F, 0, 0, 0, 0});
  }
  CHECK(track.first_unread(behind) == 0);
  CHECK(track.first_unread({changes, track.points().size()}) == track.points().size());
  CHECK(track.first_unread({changes - 2, track.points().size() - 1}) == track.points().size() - 2);
}

TEST_CASE("a long path is thinned, not forgotten", "[viewer]") {
  viewer::Change changes = 0;
  viewer::Track track(changes);
  viewer::TrackCursor cursor;
  for (std::size_t i = 0; i < viewer::Track::kMostPoints + 10; ++i)
    track.append({static_cast<std::int64_t>(i), static_cast<float>(i), 0, 0, 0, 0});
  CHECK(track.points().size() == viewer::Track::kMostPoints / 2 + 10);
  CHECK(track.points().front().utime == 0);
  CHECK(track.points().back().utime == static_cast<std::int64_t>(viewer::Track::kMostPoints + 9));
  CHECK(track.first_unread(cursor) == 0);
}

}  // namespace understory
