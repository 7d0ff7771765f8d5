// The parts of a scene, each alone.
#include "services/viewer/known_truth.hpp"
#include "services/viewer/message_ages.hpp"
#include "services/viewer/shown_closures.hpp"
#include "services/viewer/shown_map.hpp"
#include "services/viewer/shown_pose.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::viewer;

namespace {

model::SlamPose pose_at(model::Utime utime, const geometry::SE2& map_T_vehicle) {
  model::SlamPose pose;
  pose.utime = utime;
  pose.submap_T_vehicle = map_T_vehicle;
  pose.covariance = 0.01 * Eigen::Matrix3d::Identity();
  return pose;
}

}  // namespace

TEST_CASE("a message is as old as it is beyond the fastest sensor's", "[viewer]") {
  MessageAges ages;
  CHECK_FALSE(ages.age_ms(0, 5'000));  // The clocks differ by no one knows what.
  CHECK(ages.utime() == -1);
  ages.note_stamp(1'000'000, 51'000'000);  // 50 s between the clocks, and 20 ms on the way.
  ages.note_stamp(1'100'000, 51'080'000);
  CHECK(ages.age_ms(1'000'000, 51'000'000).value() == Approx(20.0));
  CHECK(ages.utime() == 1'100'000);
  CHECK(ages.newest_wall_us() == 51'080'000);

  // A clock that is set is forgotten after two periods of 10 s.
  ages.note_stamp(12'000'000, 63'000'000);
  ages.note_stamp(24'000'000, 75'000'000);
  CHECK(ages.age_ms(24'000'000, 75'000'000).value() == Approx(0.0));
  ages.clear();
  CHECK_FALSE(ages.age_ms(0, 0));
}

TEST_CASE("truth is compared in the frame of the keyframe that began the map", "[viewer]") {
  Change changes = 0;
  KnownTruth truth(changes);
  const geometry::SE2 world_T_map(100.0, 20.0, 0.5);
  CHECK_FALSE(truth.compare(pose_at(0, {})));  // No truth was heard.
  for (int i = 0; i <= 10; ++i) truth.take(i * 100'000, world_T_map * geometry::SE2(i, 0.0, 0.0));
  model::MapUpdate first;
  first.utime = 200'000;
  first.map_T_vehicle = geometry::SE2(2.0, 0.0, 0.0);
  truth.tie(first);

  const auto error = truth.compare(pose_at(650'000, geometry::SE2(6.5, 0.3, 0.0)));
  REQUIRE(error);
  CHECK(error->error_m == Approx(0.3));
  CHECK(error->error_rad == Approx(0.0).margin(1e-9));
  CHECK(error->nees.value() == Approx(9.0));
  CHECK(error->is_tied);
  CHECK(truth.pose().value->x() == Approx(6.5));
  CHECK(truth.track().points().size() == 11);

  model::SlamPose singular = pose_at(700'000, geometry::SE2(7.0, 0.0, 0.0));
  singular.covariance.setZero();
  CHECK_FALSE(truth.compare(singular)->nees);
  CHECK_FALSE(truth.compare(pose_at(2'000'000, {})));  // Beyond what was heard.

  // Another map: its frame follows from poses alone, once they are spread.
  truth.start_map();
  CHECK(truth.track().points().empty());
  CHECK_FALSE(truth.compare(pose_at(100'000, geometry::SE2(1.0, 0.0, 0.0))));
  for (int i = 2; i < 10; ++i) truth.compare(pose_at(i * 100'000, geometry::SE2(i, 0.0, 0.0)));
  const auto fitted = truth.compare(pose_at(1'000'000, geometry::SE2(10.0, 0.0, 0.0)));
  REQUIRE(fitted);
  CHECK(fitted->error_m == Approx(0.0).margin(1e-6));
  CHECK_FALSE(fitted->is_tied);
}

TEST_CASE("a closure has the result of its number, and the lowest number goes first", "[viewer]") {
  Change changes = 0;
  ShownClosures closures(changes);
  model::LoopClosure closure;
  closure.id = 7;
  closures.take(closure);
  model::LoopResult result;
  result.closure_id = 7;
  result.status = model::LoopResult::Status::kRefused;
  result.reason = "too far";
  closures.take(result);
  CHECK(closures.by_id().at(7).status == "refused");
  CHECK(closures.by_id().at(7).reason == "too far");

  const Change before = closures.change();
  result.closure_id = 8;
  closures.take(result);  // Of none of these.
  CHECK(closures.change() == before);
  for (std::uint64_t id = 100; id < 20'100; ++id) {
    closure.id = id;
    closures.take(closure);
  }
  CHECK(closures.by_id().size() == 20'000);
  CHECK_FALSE(closures.by_id().contains(7));
  closures.clear();
  CHECK(closures.by_id().empty());
}

TEST_CASE("the whole map is wanted until it comes, and where changes were missed", "[viewer]") {
  Change changes = 0;
  ShownMap map(changes);
  CHECK(map.wants_whole());
  model::WholeMap whole;
  whole.version = 4;
  map.take(whole);
  CHECK_FALSE(map.wants_whole());

  model::MapDelta delta;
  delta.base_version = 4;
  delta.version = 5;
  map.take(delta);
  CHECK_FALSE(map.wants_whole());
  delta.base_version = 6;
  delta.version = 7;
  map.take(delta);
  CHECK(map.wants_whole());

  delta.base_version = 0;
  CHECK(map.is_restarted_by(delta));
  map.start(3);
  CHECK(map.id() == 3);
  CHECK_FALSE(map.is_restarted_by(delta));
}

TEST_CASE("poses are silent after three of their intervals, 1 to 10 s", "[viewer]") {
  Change changes = 0;
  ShownPose shown(changes);
  CHECK_FALSE(shown.falls_silent(100'000'000, std::nullopt, 0));  // None has come.
  shown.take(pose_at(0, {}), 1'000'000);
  CHECK_FALSE(shown.rate_hz());
  shown.take(pose_at(2'000'000, {}), 3'000'000);
  CHECK(shown.rate_hz().value() == Approx(0.5));
  shown.judge({});
  CHECK(shown.verdict().value.state == Verdict::State::kOk);
  CHECK_FALSE(shown.falls_silent(8'900'000, shown.rate_hz(), 2'000'000));
  CHECK(shown.falls_silent(9'100'000, shown.rate_hz(), 2'000'000));
  CHECK(shown.verdict().value.state == Verdict::State::kSilent);
  CHECK(shown.falls_silent(4'100'000, std::nullopt, 2'000'000));  // Of an unknown rate: 1 s.
  CHECK(shown.falls_silent(13'100'000, 0.01, 2'000'000));
}
