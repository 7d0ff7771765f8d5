// Messages of older versions, as logs have them.
#include <algorithm>
#include <span>

#include "tests/catch.hpp"
#include "tests/wire/value_maker.hpp"

using namespace understory;
using namespace understory::wire;

namespace {

/// The version of ODOMETRY that older logs have.
odometry_t old_version(const odometry2_t& wire) {
  odometry_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.from_utime = wire.from_utime;
  old.from_T_to = wire.from_T_to;

  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      old.covariance[row][column] = wire.covariance[row][column];
    }
  }

  old.has_wheels = wire.has_wheels;
  old.is_standing = wire.is_standing;
  old.num_inertial = wire.num_inertial;
  old.inertial = wire.inertial;

  return old;
}

keyframe_t old_version(const keyframe2_t& wire) {
  keyframe_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.max_range_m = wire.max_range_m;
  old.bearing_rad = wire.bearing_rad;
  old.width_rad = wire.width_rad;
  old.has_previous = wire.has_previous;
  old.previous_T_base = wire.previous_T_base;
  old.num_members = wire.num_members;
  old.members = wire.members;
  old.num_landmarks = wire.num_landmarks;
  old.landmarks = wire.landmarks;
  return old;
}

slam_pose_t old_version(const slam_pose2_t& wire) {
  slam_pose_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.status = wire.status;
  old.keyframe_seq = wire.keyframe_seq;
  old.submap_id = wire.submap_id;
  old.submap_T_vehicle = wire.submap_T_vehicle;
  std::ranges::copy(std::span(&wire.covariance[0][0], 9), &old.covariance[0][0]);
  old.correction_version = wire.correction_version;
  old.map_T_submap = wire.map_T_submap;
  old.map_T_odom = wire.map_T_odom;
  old.reset_counter = wire.reset_counter;
  old.reset_delta = wire.reset_delta;
  return old;
}

slam_update2_t version_2(const slam_update3_t& wire) {
  slam_update2_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.keyframe_seq = wire.keyframe_seq;
  old.status = wire.status;
  old.map_id = wire.map_id;
  old.provisional = wire.provisional;
  old.lost = wire.lost;
  old.map_T_vehicle = wire.map_T_vehicle;
  std::ranges::copy(std::span(&wire.covariance[0][0], 9), &old.covariance[0][0]);
  old.map_T_latest_vehicle = wire.map_T_latest_vehicle;
  old.num_associations = wire.num_associations;
  old.associations = wire.associations;
  old.num_scans = wire.num_scans;
  old.scans = wire.scans;
  old.num_detections = wire.num_detections;
  old.detections = wire.detections;
  old.num_expected = wire.num_expected;
  for (const expected_landmark_t& one : wire.expected) old.expected.push_back(one.landmark_id);
  old.reason = wire.reason;
  return old;
}

slam_update_t old_version(const slam_update3_t& wire) {
  slam_update_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.keyframe_seq = wire.keyframe_seq;
  old.status = wire.status;
  old.map_T_vehicle = wire.map_T_vehicle;
  std::ranges::copy(std::span(&wire.covariance[0][0], 9), &old.covariance[0][0]);
  old.map_T_latest_vehicle = wire.map_T_latest_vehicle;
  old.num_associations = wire.num_associations;
  old.associations = wire.associations;
  old.reason = wire.reason;
  return old;
}

loop_closure_t old_version(const loop_closure2_t& wire) {
  loop_closure_t old{};
  old.utime = wire.utime;
  old.seq = wire.seq;
  old.map_id = wire.map_id;
  old.closure_id = wire.closure_id;
  old.source = wire.source;
  old.revoked = wire.revoked;
  old.from = wire.from_end;
  old.to = wire.to_end;
  old.from_T_to = wire.from_T_to;
  std::ranges::copy(std::span(&wire.covariance[0][0], 9), &old.covariance[0][0]);
  old.log10_false_alarm = wire.log10_false_alarm;
  return old;
}

}  // namespace

TEST_CASE("odometry of the version before is read, without the level's error") {
  Maker values(11);
  bool had_inertial = false;
  for (int i = 0; i < 50; ++i) {
    model::Odometry should = values.odometry();
    const auto is = decode_message<model::Odometry>(encode_bytes(old_version(to_wire(should))));
    REQUIRE(is);
    had_inertial = had_inertial || should.inertial;
    if (should.inertial) should.inertial->level = model::LevelError{};
    CHECK(encode_message(*is) == encode_message(should));
  }
  CHECK(had_inertial);
}

TEST_CASE("a level at rest of the version before changes by as much as it may be wrong") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Maker make(seed);
    model::RestLevel level{9, 4, 3, 8, make.vector<2>(0.01), make.covariance<2>(), {}};
    const rest_level2_t wire = to_wire(level);
    rest_level_t old{};
    old.utime = wire.utime;
    old.seq = wire.seq;
    old.rest_from_utime = wire.rest_from_utime;
    old.rest_utime = wire.rest_utime;
    std::ranges::copy(wire.error_rad, old.error_rad);
    std::ranges::copy(std::span(&wire.covariance[0][0], 4), &old.covariance[0][0]);

    const auto is = decode_message<model::RestLevel>(encode_bytes(old));
    REQUIRE(is);
    level.change_covariance = level.covariance;
    CHECK(encode_message(*is) == encode_message(level));
  }
}

TEST_CASE("keyframes, updates and poses of the versions before are read, as far as they go") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Maker make(seed);
    model::Keyframe keyframe = make.keyframe();
    const auto old = decode_message<model::Keyframe>(encode_bytes(old_version(to_wire(keyframe))));
    REQUIRE(old);
    keyframe.detections.clear();
    CHECK(encode_message(*old) == encode_message(keyframe));

    model::SlamPose pose = make.slam_pose();
    pose.is_lost = pose.is_new_map = pose.is_provisional = false;
    pose.map_id = 1;
    const auto old_pose = decode_message<model::SlamPose>(encode_bytes(old_version(to_wire(pose))));
    REQUIRE(old_pose);
    CHECK(encode_message(*old_pose) == encode_message(pose));

    model::MapUpdate update;
    update.map_T_vehicle = make.pose();
    update.covariance = make.covariance<3>();
    update.associations = {{0, 5}, {2, 6}};
    const auto old_update =
        decode_message<model::MapUpdate>(encode_bytes(old_version(to_wire(update))));
    REQUIRE(old_update);
    CHECK(encode_message(*old_update) == encode_message(update));

    update.map_id = 3;
    update.is_provisional = true;
    update.scans = {{90, 4}};
    update.detections = {{0, 3, 5}};
    update.expected = {{8}, {9}};
    model::MapUpdate with_sights = update;
    with_sights.expected[1].sight = model::LineOfSight::kClear;
    const auto version_2_update =
        decode_message<model::MapUpdate>(encode_bytes(version_2(to_wire(with_sights))));
    REQUIRE(version_2_update);
    CHECK(encode_message(*version_2_update) == encode_message(update));
  }
}

TEST_CASE("loop closures of the version before are read") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Maker make(seed);
    model::LoopClosure closure;
    closure.utime = 40;
    closure.sequence = seed;
    closure.map_id = 3;
    closure.id = 12;
    closure.source = "manual";
    closure.is_revoked = seed % 5 == 0;
    closure.from = {3, 0};
    closure.to = {0, 812};
    closure.from_T_to = {make.pose(), make.covariance<3>() + Eigen::Matrix3d::Identity()};
    closure.log10_false_alarm = -7.0;

    const auto should = decode_message<model::LoopClosure>(encode_message(closure));
    const auto is = decode_message<model::LoopClosure>(encode_bytes(old_version(to_wire(closure))));
    REQUIRE(is);
    CHECK(encode_message(*is) == encode_message(*should));
  }
}
