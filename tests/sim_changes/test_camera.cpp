// What the sensors show of a changed copy, against brute force and statistics.
#include <Eigen/LU>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "tests/catch.hpp"
#include "tests/sim_changes/changes_fixture.hpp"

using namespace understory;
using namespace understory::sim::changes;
using understory::test::course_of;
using understory::test::slow_camera;

namespace {

/// Whether any object is in front of the point; leaves, which let rays through by chance, are not
/// there in rooms.
ThingId first_thing(const BuiltScene& built, const Eigen::Vector3d& from_m,
                    const Eigen::Vector3d& to_m) {
  const double distance = (to_m - from_m).norm();
  const sim::Ray ray{from_m, (to_m - from_m) / distance};
  double nearest = distance - 0.01;
  ThingId in_front = kGroundThing;
  for (sim::ObjectId i = 0; i < built.world->object_count(); ++i) {
    const auto hit = built.world->meet_object(ray, i, 0.0, 0);
    if (!hit || hit->range_m >= nearest) continue;
    nearest = hit->range_m;
    in_front = built.thing_of(i);
  }
  return in_front;
}

const SurfacePoint& point_of(const Stage& stage, PointId id) {
  const auto found = std::lower_bound(stage.points.begin(), stage.points.end(), id,
                                      [](const SurfacePoint& p, PointId x) { return p.id < x; });
  REQUIRE(found != stage.points.end());
  REQUIRE(found->id == id);
  return *found;
}

Replay changed_replay(SceneKind kind, double share = 0.3, std::uint64_t seed = 1) {
  const Course course = course_of(kind, seed);
  DiffParameters parameters;
  parameters.share = share;
  return {course, make_diff(course, parameters, seed + 10)};
}

}  // namespace

TEST_CASE("points lie on the surface of their thing and go where it goes") {
  const Course course = course_of(SceneKind::kOffice);
  const Diff diff = make_diff(course, {}, 2);
  const Stage before(course.scene), after(changed(course.scene, diff));
  CHECK(before.points.size() > 2000);
  std::set<PointId> ids;
  for (const SurfacePoint& point : before.points) {
    REQUIRE(ids.insert(point.id).second);
    REQUIRE(point.normal.norm() == Approx(1.0));
    // From just outside, the surface is where the point is.
    const sim::Ray ray{point.position_m + 0.01 * point.normal, -point.normal};
    double nearest = 1e9;
    for (sim::ObjectId i = 0; i < before.built.world->object_count(); ++i) {
      if (before.built.thing_of(i) != thing_of(point.id)) continue;
      const auto hit = before.built.world->meet_object(ray, i, 0.0, 0);
      if (hit) nearest = std::min(nearest, hit->range_m);
    }
    REQUIRE(nearest == Approx(0.01).margin(1e-6));
  }

  for (const Move& move : diff.moved) {
    const PointId first = (PointId{move.thing} << kPointBits) + 1;
    const SurfacePoint& was = point_of(before, first);
    const SurfacePoint& is = point_of(after, first);
    CHECK((is.position_m - was.position_m - move.by_m).norm() < 1e-12);
    CHECK(is.descriptor == was.descriptor);
  }
}

TEST_CASE("sights are those of brute-force ray casting, in both copies") {
  for (const SceneKind kind : {SceneKind::kOffice, SceneKind::kStation}) {
    const Replay replay = changed_replay(kind);
    const ChangedDrive drive = replay.drive(slow_camera(kind), 3);
    const Stage& before = replay.unchanged();
    const Stage& after = replay.copy();
    std::map<Sight, int> count;
    for (const CameraFrame& frame : drive.frames) {
      const Eigen::Vector3d eye = frame.world_T_camera.translation();
      for (const ExpectedPoint& expected : frame.expected) {
        ++count[expected.sight];
        if (expected.sight == Sight::kNew) {
          CHECK(first_thing(after.built, eye, point_of(after, expected.point).position_m) ==
                kGroundThing);
          continue;
        }
        const Eigen::Vector3d at = point_of(before, expected.point).position_m;
        const bool was_hidden = first_thing(before.built, eye, at) != kGroundThing;
        const ThingId now = first_thing(after.built, eye, at);
        REQUIRE(expected.was_visible == !was_hidden);
        REQUIRE(expected.occluder == now);
        REQUIRE(expected.range_m == Approx((at - eye).norm()));
        if (expected.sight == Sight::kVisible) REQUIRE(now == kGroundThing);
        if (expected.sight == Sight::kHidden) REQUIRE((now != kGroundThing && was_hidden));
        if (expected.sight == Sight::kNewlyHidden) REQUIRE((now != kGroundThing && !was_hidden));
      }
    }
    CHECK(count.size() == 5);
  }
}

TEST_CASE("gone is what was removed or moved; what newly hides is new or was moved") {
  for (const SceneKind kind : understory::test::kAllScenes) {
    CAPTURE(to_string(kind));
    const Replay replay = changed_replay(kind, 0.4);
    const ChangedDrive drive = replay.drive(slow_camera(kind), 3);
    std::map<ThingId, ThingState> state;
    for (const TrueThing& thing : drive.things) state[thing.id] = thing.state;
    int hidden_by_other = 0, hidden = 0;
    for (const CameraFrame& frame : drive.frames) {
      for (const ExpectedPoint& expected : frame.expected) {
        const ThingState of_thing = state.at(thing_of(expected.point));
        const bool is_away = of_thing == ThingState::kGone || of_thing == ThingState::kMoved;
        REQUIRE((expected.sight == Sight::kGone) == (is_away && expected.sight != Sight::kNew));
        if (expected.sight == Sight::kNew)
          REQUIRE((of_thing == ThingState::kNew || of_thing == ThingState::kMoved));
        if (expected.sight != Sight::kNewlyHidden) continue;
        ++hidden;
        const ThingState of_occluder = state.at(expected.occluder);
        hidden_by_other +=
            of_occluder != ThingState::kNew && of_occluder != ThingState::kMoved ? 1 : 0;
      }
    }
    CHECK(hidden > 20);
    CHECK(hidden_by_other == 0);
  }
}

TEST_CASE("no keypoint of what is hidden or gone; pixels are where geometry says") {
  const Replay replay = changed_replay(SceneKind::kOffice);
  CameraParameters camera = slow_camera(SceneKind::kOffice);
  camera.rate_hz = 2.0;
  const ChangedDrive drive = replay.drive(camera, 3);
  double squares = 0.0, disparity_squares = 0.0;
  std::size_t expected = 0, detected = 0, falses = 0;
  double flips = 0.0;
  for (const CameraFrame& frame : drive.frames) {
    std::map<PointId, Sight> sight;
    for (const ExpectedPoint& point : frame.expected) {
      if (point.sight == Sight::kVisible || point.sight == Sight::kNew) {
        sight[point.point] = point.sight;
        ++expected;
      }
    }
    for (const Keypoint& keypoint : frame.keypoints) {
      if (keypoint.point == kNoPoint) {
        ++falses;
        continue;
      }
      REQUIRE(sight.contains(keypoint.point));
      REQUIRE(keypoint.thing == thing_of(keypoint.point));
      const SurfacePoint& truth = point_of(replay.copy(), keypoint.point);
      const Eigen::Vector3d at = frame.world_T_camera.inverse() * truth.position_m;
      squares += (camera.project(at) - keypoint.pixel).squaredNorm();
      disparity_squares +=
          std::pow(camera.focal_px * camera.baseline_m / at.z() - keypoint.disparity_px, 2);
      flips += hamming_distance(keypoint.descriptor, truth.descriptor);
      ++detected;
    }
  }

  const auto n = static_cast<double>(detected);
  REQUIRE(detected > 5000);
  CHECK(n / static_cast<double>(expected) == Approx(camera.recall).margin(0.015));
  CHECK(std::sqrt(0.5 * squares / n) == Approx(camera.pixel_sigma).epsilon(0.05));
  CHECK(std::sqrt(disparity_squares / n) == Approx(camera.disparity_sigma).epsilon(0.05));
  CHECK(static_cast<double>(falses) / static_cast<double>(drive.frames.size()) ==
        Approx(camera.false_per_frame).epsilon(0.12));
  CHECK(flips / n / 256.0 > camera.flip_rate);
  CHECK(flips / n / 256.0 < camera.flip_rate + camera.flip_rate_oblique);
}

TEST_CASE("detector of any quality: none found, all found, fewer when far") {
  const Replay replay = changed_replay(SceneKind::kStation);
  CameraParameters camera = slow_camera(SceneKind::kStation);
  camera.false_per_frame = 0.0;
  const auto share = [&](double recall, double loss) {
    camera.recall = recall;
    camera.recall_loss_far = loss;
    std::size_t found = 0, all = 0;
    for (const CameraFrame& frame : replay.drive(camera, 3).frames) {
      found += frame.keypoints.size();
      for (const ExpectedPoint& e : frame.expected)
        all += e.sight == Sight::kVisible || e.sight == Sight::kNew ? 1 : 0;
    }
    return static_cast<double>(found) / static_cast<double>(all);
  };
  CHECK(share(0.0, 0.0) == 0.0);
  CHECK(share(1.0, 0.0) == 1.0);
  CHECK(share(1.0, 0.8) < 0.9);
}

TEST_CASE("stereo: a pixel and a disparity are the point again") {
  const CameraParameters camera = camera_for(SceneKind::kForest);
  const Eigen::Vector3d at(0.7, -0.4, 6.0);
  const double disparity = camera.focal_px * camera.baseline_m / at.z();
  CHECK((camera.triangulate(camera.project(at), disparity) - at).norm() < 1e-12);
  CHECK(camera.sees(at));
  CHECK_FALSE(camera.sees({0.0, 0.0, -6.0}));
  CHECK_FALSE(camera.sees({0.0, 0.0, 50.0}));
  CHECK_FALSE(camera.sees({20.0, 0.0, 6.0}));
  // Ahead of the body is into the image, its left is left of the middle.
  const Eigen::Vector3d ahead = camera.body_T_camera.inverse() * Eigen::Vector3d(9.0, 1.0, 1.5);
  CHECK(ahead.z() > 0.0);
  CHECK(camera.project(ahead).x() < 0.5 * camera.width_px);
}

TEST_CASE("a removed thing gives no return of the LIDAR, a new one does") {
  for (const SceneKind kind : {SceneKind::kOffice, SceneKind::kForest}) {
    CAPTURE(to_string(kind));
    const Course course = course_of(kind);
    DiffParameters parameters;
    parameters.share = 0.4;
    const Diff diff = make_diff(course, parameters, 4);
    const Replay unchanged(course, {}), replay(course, diff);

    const auto seen = [&](const Replay& which) {
      std::map<ThingId, int> returns;
      auto drive = which.sensors(suite_for(kind), 5);
      for (std::uint64_t k = 20; k < drive.sweep_count(); k += 60) {
        for (const sim::ObjectId object : drive.sweep(k).objects)
          ++returns[which.copy().built.thing_of(object)];
      }
      return returns;
    };
    const auto before = seen(unchanged), after = seen(replay);
    int removed_before = 0, new_after = 0;
    for (const ThingId id : diff.removed) {
      removed_before += before.contains(id) ? 1 : 0;
      CHECK_FALSE(after.contains(id));
    }
    for (const Thing& thing : diff.added) new_after += after.contains(thing.id) ? 1 : 0;
    CHECK(2 * removed_before > static_cast<int>(diff.removed.size()));
    CHECK(2 * new_after > static_cast<int>(diff.added.size()));
  }
}

TEST_CASE("with the same noise, sweeps through two copies differ only where something changed") {
  const Course course = course_of(SceneKind::kForest);
  const Diff diff = make_diff(course, {}, 4);
  const Replay unchanged(course, {}), replay(course, diff);
  auto a = unchanged.sensors(suite_for(SceneKind::kForest), 5);
  auto b = replay.sensors(suite_for(SceneKind::kForest), 5);
  const auto points = [](const Replay& which, const sim::SimulatedSweep& sweep) {
    std::map<std::pair<float, int>, std::pair<ThingId, Eigen::Vector3f>> result;
    for (std::size_t i = 0; i < sweep.objects.size(); ++i) {
      const model::SweepPoint& p = sweep.raw.points[i];
      result[{p.time_s, p.ring}] = {which.copy().built.thing_of(sweep.objects[i]), p.position()};
    }
    return result;
  };
  const auto before = points(unchanged, a.sweep(100));
  const auto after = points(replay, b.sweep(100));

  std::map<ThingId, ThingState> state;
  for (const TrueThing& thing : compare(unchanged.copy().scene, replay.copy().scene))
    state[thing.id] = thing.state;
  state[kGroundThing] = ThingState::kPresent;
  int same = 0, other = 0;
  for (const auto& [beam, hit] : before) {
    if (!after.contains(beam)) continue;
    const auto& now = after.at(beam);
    const bool is_same = now.first == hit.first && now.second == hit.second;
    ++(is_same ? same : other);
    if (is_same || now.first == hit.first) continue;
    // Something went away in front, or came.
    CHECK((state.at(hit.first) != ThingState::kPresent ||
           state.at(now.first) != ThingState::kPresent));
  }
  CHECK(same > 10'000);
  CHECK(other > 100);
}

TEST_CASE("the path is the same in every copy, to the bit") {
  const Course course = course_of(SceneKind::kForest);
  const Replay unchanged(course, {}), replay(course, make_diff(course, {}, 4));
  for (double t = 0.0; t < unchanged.motion().duration_s(); t += 0.9) {
    REQUIRE(unchanged.motion().at(t).world_T_vehicle().matrix() ==
            replay.motion().at(t).world_T_vehicle().matrix());
  }
  const auto camera = slow_camera(SceneKind::kForest);
  const auto a = unchanged.stops(camera), b = replay.stops(camera);
  REQUIRE(a.size() == b.size());
  CHECK(a.back().utime == b.back().utime);
}

TEST_CASE("without a diff nothing is gone, new or newly hidden") {
  for (const SceneKind kind : understory::test::kAllScenes) {
    const Replay replay(course_of(kind), {});
    const ChangedDrive drive = replay.drive(slow_camera(kind), 3);
    for (const CameraFrame& frame : drive.frames) {
      for (const ExpectedPoint& expected : frame.expected)
        REQUIRE((expected.sight == Sight::kVisible || expected.sight == Sight::kHidden));
    }
    for (const TruePoint& point : drive.points) REQUIRE(point.state == PointState::kPresent);
  }
}
