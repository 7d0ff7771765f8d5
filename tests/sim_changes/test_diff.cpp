// Courses and diffs: shares, ids, moves, free paths, clear-cuts.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sim/changes/changing_forest.hpp"
#include "sim/changes/placing.hpp"
#include "tests/catch.hpp"
#include "tests/sim_changes/changes_fixture.hpp"

using namespace understory;
using namespace understory::sim::changes;
using understory::test::course_of;
using understory::test::kAllScenes;

namespace {

std::size_t changeable(const Scene& scene) {
  std::size_t count = 0;
  for (const Thing& thing : scene.things) count += thing.is_changeable() ? 1 : 0;
  return count;
}

bool same_extent(const Thing& a, const Thing& b) {
  return a.extent.centre_m == b.extent.centre_m && a.extent.half_size_m == b.extent.half_size_m &&
         a.extent.heading_rad == b.extent.heading_rad;
}

}  // namespace

TEST_CASE("a course is furnished, its path is free, and the seed decides all of it") {
  for (const SceneKind kind : kAllScenes) {
    CAPTURE(to_string(kind));
    const Course course = course_of(kind);
    const Course again = course_of(kind);
    const Course other = course_of(kind, 2);
    CHECK(changeable(course.scene) > 30);
    REQUIRE(course.scene.things.size() == again.scene.things.size());
    for (std::size_t i = 0; i < course.scene.things.size(); ++i) {
      REQUIRE(course.scene.things[i].id == again.scene.things[i].id);
      REQUIRE(same_extent(course.scene.things[i], again.scene.things[i]));
    }
    CHECK_FALSE(same_extent(course.scene.things.back(), other.scene.things.back()));

    const double clearance = kind == SceneKind::kForest ? 2.0 : 0.4;
    for (const Eigen::Vector3d& place : course.path.places_m(0.25)) {
      for (const Thing& thing : course.scene.things) {
        if (thing.is_changeable()) REQUIRE(distance_m(thing.extent, place) >= clearance);
      }
    }
  }
}

TEST_CASE("the body has five degrees of freedom in rooms: it never rolls") {
  for (const SceneKind kind : {SceneKind::kOffice, SceneKind::kStation}) {
    CourseParameters parameters;
    parameters.laps = 2;
    const Course course = make_course(kind, parameters, 1);
    double least_pitch = 0.0, most_pitch = 0.0, least_z = 1e9, most_z = 0.0;
    for (const auto& pose : course.path.poses) {
      REQUIRE(pose[3] == 0.0);
      least_z = std::min(least_z, pose[2]);
      most_z = std::max(most_z, pose[2]);
      least_pitch = std::min(least_pitch, pose[4]);
      most_pitch = std::max(most_pitch, pose[4]);
    }
    CHECK(most_z - least_z > 0.2);
    CHECK(most_pitch - least_pitch > 0.3);
    // A turn is turned, not jumped.
    for (std::size_t i = 1; i < course.path.poses.size(); ++i) {
      const auto step = (course.path.poses[i] - course.path.poses[i - 1]).eval();
      REQUIRE(step.head<3>().norm() / course.path.step_s < 1.0);
      REQUIRE(std::abs(step[5]) / course.path.step_s < 2.0);
    }
  }
}

TEST_CASE("no course without a lap or a length") {
  CourseParameters parameters;
  parameters.laps = 0;
  for (const SceneKind kind : kAllScenes)
    CHECK_THROWS_AS(make_course(kind, parameters, 1), std::runtime_error);
  parameters = {};
  parameters.length_m = 0.0;
  CHECK_THROWS_AS(make_course(SceneKind::kForest, parameters, 1), std::runtime_error);
}

TEST_CASE("a recorded path is replayed: velocity and rates are the derivatives of the pose") {
  const Course course = course_of(SceneKind::kStation);
  const sim::VehicleMotion motion = course.path.replay();
  CHECK(motion.duration_s() ==
        Approx(course.path.step_s * static_cast<double>(course.path.poses.size() - 1)));
  CHECK(motion.driven_m() > 10.0);
  constexpr double kStep = 1e-4;
  for (double t = 3.0; t < motion.duration_s() - 3.0; t += 1.7) {
    const auto before = motion.at(t - kStep), at = motion.at(t), after = motion.at(t + kStep);
    const Eigen::Vector3d velocity = (after.position_m - before.position_m) / (2.0 * kStep);
    CHECK((velocity - at.velocity_mps).norm() < 1e-5);
    const Eigen::AngleAxisd turn(before.world_Q_vehicle.conjugate() * after.world_Q_vehicle);
    const Eigen::Vector3d rate = turn.angle() * turn.axis() / (2.0 * kStep);
    CHECK((rate - at.angular_rate_rad_s).norm() < 1e-5);
  }
}

TEST_CASE("the share asked for is the share changed, at every difficulty") {
  for (const SceneKind kind : kAllScenes) {
    const Course course = course_of(kind);
    const auto all = static_cast<double>(changeable(course.scene));
    for (const double share : {0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 1.0}) {
      CAPTURE(to_string(kind), share);
      DiffParameters parameters;
      parameters.share = share;
      const Diff diff = make_diff(course, parameters, 3);
      CHECK(diff.removed.size() + diff.moved.size() ==
            static_cast<std::size_t>(std::lround(share * all)));
      CHECK(diff.added.size() <= diff.removed.size());
    }
  }
}

TEST_CASE("ids last: what stays keeps its id and place, what is new has one never used") {
  for (const SceneKind kind : kAllScenes) {
    CAPTURE(to_string(kind));
    const Course course = course_of(kind);
    DiffParameters parameters;
    parameters.share = 0.3;
    parameters.move_m = 0.4;
    const Diff diff = make_diff(course, parameters, 5);
    const Scene after = changed(course.scene, diff);
    const auto truth = compare(course.scene, after);

    std::map<ThingState, std::size_t> count;
    for (const TrueThing& thing : truth) {
      ++count[thing.state];
      const Thing* const was = course.scene.find(thing.id);
      const Thing* const is = after.find(thing.id);
      CHECK((was == nullptr) == (thing.state == ThingState::kNew));
      CHECK((is == nullptr) == (thing.state == ThingState::kGone));
      if (thing.state == ThingState::kPresent) CHECK(same_extent(*was, *is));
      if (thing.state == ThingState::kMoved)
        CHECK(thing.by_m.head<2>().norm() == Approx(0.4).epsilon(1e-9));
      if (thing.state == ThingState::kNew) CHECK(thing.id >= course.scene.next_id);
    }
    CHECK(count[ThingState::kGone] == diff.removed.size());
    CHECK(count[ThingState::kMoved] == diff.moved.size());
    CHECK(count[ThingState::kNew] == diff.added.size() + diff.occluders.size());
    CHECK(diff.occluders.size() == 2);
    CHECK(after.next_id > after.things.back().id);
  }
}

TEST_CASE("what is new or moved leaves the path free and stands in nothing else") {
  for (const SceneKind kind : kAllScenes) {
    CAPTURE(to_string(kind));
    const Course course = course_of(kind);
    DiffParameters parameters;
    parameters.share = 0.5;
    const Diff diff = make_diff(course, parameters, 8);
    const Scene after = changed(course.scene, diff);
    std::set<ThingId> placed;
    for (const Move& move : diff.moved) placed.insert(move.thing);
    for (const Thing& thing : after.things) {
      if (thing.id >= course.scene.next_id) placed.insert(thing.id);
    }

    const double clearance = kind == SceneKind::kForest ? 2.0 : 0.4;
    const auto places = course.path.places_m(0.25);
    for (const ThingId id : placed) {
      const Thing& thing = *after.find(id);
      for (const Eigen::Vector3d& place : places)
        REQUIRE(distance_m(thing.extent, place) >= clearance);
      for (const Thing& other : after.things) {
        if (other.id != id && other.is_changeable())
          REQUIRE_FALSE(are_close(thing.extent, other.extent, 0.0));
      }
    }
  }
}

TEST_CASE("a clear-cut fells neighbours and parks a lorry that hides others") {
  CourseParameters parameters;
  parameters.forest = sim::ForestKind::kDense;
  const Course course = make_course(SceneKind::kForest, parameters, 4);
  const Diff diff = make_clear_cut(course, {}, 9);
  REQUIRE(diff.removed.size() == 50);
  REQUIRE(diff.occluders.size() == 1);
  CHECK(diff.occluders.front().kind == ThingKind::kLorry);
  CHECK(diff.moved.empty());

  // Neighbours: no tree that stands is nearer to their middle than half of them are.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const ThingId id : diff.removed)
    middle += course.scene.find(id)->extent.centre_m.head<2>() / 50.0;
  int standing_inside = 0;
  std::vector<double> felled;
  for (const ThingId id : diff.removed)
    felled.push_back((course.scene.find(id)->extent.centre_m.head<2>() - middle).norm());
  std::sort(felled.begin(), felled.end());
  for (const Thing& thing : changed(course.scene, diff).things) {
    if (thing.kind != ThingKind::kTree) continue;
    standing_inside += (thing.extent.centre_m.head<2>() - middle).norm() < felled[25] ? 1 : 0;
  }
  CHECK(standing_inside == 0);

  ClearCutParameters too_many;
  too_many.felled = 1'000'000;
  CHECK_THROWS_AS(make_clear_cut(course, too_many, 9), std::runtime_error);
}

TEST_CASE("a forest that changes between drives: shares, and the ledger of its trees") {
  ChangingForestParameters parameters;
  parameters.course.length_m = 60.0;
  parameters.course.margin_m = 25.0;
  parameters.drives = 4;
  const ChangingForest forest = make_changing_forest(parameters, 6);
  REQUIRE(forest.drives.size() == 4);

  for (int drive = 0; drive < 4; ++drive) {
    const ForestDrive& one = forest.drives[static_cast<std::size_t>(drive)];
    std::size_t standing = 0, felled = 0;
    for (const TreeTruth& tree : forest.trees) {
      standing += tree.stands_in(drive) ? 1 : 0;
      felled += tree.last_drive == drive ? 1 : 0;
    }
    CHECK(one.scenario.world->trunks().size() == standing);
    if (drive < 3)
      CHECK(felled == static_cast<std::size_t>(std::lround(0.1 * static_cast<double>(standing))));
    for (const sim::TrueTrunk& trunk : one.scenario.world->trunks()) {
      const ThingId id = one.thing_of_object[trunk.object];
      const auto found = std::find_if(forest.trees.begin(), forest.trees.end(),
                                      [&](const TreeTruth& tree) { return tree.id == id; });
      REQUIRE(found != forest.trees.end());
      CHECK(found->stands_in(drive));
      CHECK(found->position_m == trunk.centre_m.head<2>());  // in every drive the same
    }
    CHECK(one.utime_of_start == drive * std::int64_t{30} * 86'400'000'000);
  }

  sim::SensorSuite suite;
  suite.lidar.reset();
  auto drive = forest.drives[1].sensors(suite, {}, 3);
  const auto reading = drive.next();
  REQUIRE(reading);
  CHECK(std::get<sim::TruePose>(*reading).utime == forest.drives[1].utime_of_start);
}
