// Values -> wire -> values is the identity, and what comes in is checked.
#include <Eigen/Eigenvalues>
#include <numbers>
#include <random>

#include "common/wire/checks.hpp"
#include "tests/catch.hpp"
#include "tests/wire/value_maker.hpp"

using namespace understory;
using namespace understory::wire;

namespace {

/// Sent and received again; the same value encodes to the same bytes.
template <class T>
void check_round_trip(const T& value) {
  const Bytes bytes = encode_message(value);
  const auto back = decode_message<T>(bytes);
  INFO((back ? "" : back.refusal().detail));
  REQUIRE(back);
  CHECK(encode_message(*back) == bytes);
}

Reason reason_of(const landmarks_t& scan) {
  const auto result = from_wire(scan);
  REQUIRE_FALSE(result);
  return result.refusal().reason;
}

landmarks_t scan_with_one() {
  landmarks_t scan{};
  scan.max_range_m = 40.0;
  scan.width_rad = 1.0;
  scan.num_detections = 1;
  scan.detections.push_back(detection_t{});
  for (int i = 0; i < 3; ++i) scan.detections[0].covariance_m2[i][i] = 0.01;
  return scan;
}

}  // namespace

TEST_CASE("detections that are not each of one landmark are refused") {
  Maker make(5);
  model::Keyframe keyframe = make.keyframe();
  while (keyframe.landmarks.size() < 2) keyframe = make.keyframe();
  REQUIRE(from_wire(to_wire(keyframe)));
  const auto reason = [&](std::vector<model::KeyframeDetection> detections) {
    keyframe.detections = std::move(detections);
    return from_wire(to_wire(keyframe)).refusal().reason;
  };
  const auto most = static_cast<std::uint32_t>(keyframe.landmarks.size());
  CHECK(reason({{0, 1, 0}, {0, 1, 1}}) == Reason::kInconsistent);
  CHECK(reason({{0, 2, 0}, {0, 1, 1}}) == Reason::kInconsistent);
  CHECK(reason({{0, 1, most}}) == Reason::kOutOfRange);
  CHECK(reason({{static_cast<std::uint32_t>(keyframe.members.size()), 1, 0}}) ==
        Reason::kOutOfRange);

  model::MapUpdate update;
  update.scans = {{90, 4}};
  update.detections = {{0, 1, 7}, {0, 1, 7}};
  CHECK(from_wire(to_wire(update)).refusal().reason == Reason::kInconsistent);
  update.detections = {{1, 1, 7}};
  CHECK(from_wire(to_wire(update)).refusal().reason == Reason::kOutOfRange);
  update.detections.clear();
  update.map_id = 0;
  CHECK(from_wire(to_wire(update)).refusal().reason == Reason::kOutOfRange);
}

TEST_CASE("values survive the wire") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Maker make(seed);
    check_round_trip(make.scan());
    check_round_trip(make.keyframe());
    check_round_trip(make.odometry());
    check_round_trip(make.slam_pose());
    check_round_trip(make.view_ranges());
    check_round_trip(make.place_scan());
    check_round_trip(model::WholeMap{
        10, 1, 5, true, make.landmarks(), {{1, 10, make.pose(), make.covariance<3>()}}});

    check_round_trip(
        model::MapDelta{10, 1, 4, 5, make.landmarks(), make.landmarks(), {8, 9}, {{6, 7}}});
    model::MapUpdate update;
    update.keyframe_sequence = 12;
    update.utime = 99;
    update.status = model::MapUpdateStatus::kNotSure;
    update.map_T_vehicle = make.pose();
    update.covariance = make.covariance<3>();
    update.associations = {{0, 5}, {2, 6}};
    update.added = {7};
    update.merged = {{5, 6}};
    update.reason = "a runner-up";
    update.map_id = 3;
    update.is_provisional = seed % 2 == 0;
    update.is_lost = seed % 3 == 0;
    update.scans = {{90, 4}, {99, 5}};
    update.detections = {{0, 3, 5}, {1, 0, 0}, {1, 2, 6}};
    update.expected = {{8, model::LineOfSight::kClear}, {9}, {12, model::LineOfSight::kBlocked}};
    check_round_trip(update);
  }
}

TEST_CASE("submaps and closures survive the wire") {
  Maker make(8);
  for (int round = 0; round < 20; ++round) {
    model::Submap submap;
    submap.utime = 40;
    submap.map_id = 3;
    submap.id = 1 + make.count();
    submap.map_T_submap = make.pose();
    submap.landmarks = make.landmarks();
    submap.keyframes = {{4, 20, make.pose(), make.covariance<3>()}};
    submap.replaced.assign(make.count(), 7);
    submap.payload = std::string("\0\xff payload", 10);
    submap.content_hash = model::fnv1a(submap.payload);
    check_round_trip(submap);
    submap.payload[2] = 'x';
    CHECK(from_wire(to_wire(submap)).refusal().reason == Reason::kInconsistent);

    check_round_trip(model::SubmapStored{40, 2, 3, 9, submap.content_hash});
    check_round_trip(model::SubmapQuery{40, 2, 3, {1, 5, 2}});
    check_round_trip(model::MapCorrection{40, 2, 3, 8, {{1, make.pose()}, {4, make.pose()}}});
    CHECK_FALSE(from_wire(to_wire(model::MapCorrection{40, 2, 3, 8, {{4, {}}, {4, {}}}})));

    model::LoopClosure closure;
    closure.id = 12;
    closure.source = "manual";
    closure.from = {3, 0};
    closure.to = {0, 812};
    closure.from_T_to = {make.pose(), make.covariance<3>() + Eigen::Matrix3d::Identity()};
    closure.log10_false_alarm = -7.0;
    check_round_trip(closure);
    closure.is_revoked = true;
    CHECK(from_wire(to_wire(closure))->is_revoked);
    closure.is_revoked = false;
    closure.from_T_to.covariance.setZero();
    CHECK(from_wire(to_wire(closure)).refusal().reason == Reason::kInconsistent);
    check_round_trip(model::LoopResult{40, 2, 3, 12, model::LoopResult::Status::kRefused,
                                       "far from consistent"});
  }
}

TEST_CASE("existence survives the wire") {
  Maker make(9);
  for (int round = 0; round < 20; ++round) {
    model::Existence existence{40, 2, 3, round % 2 == 0, {}, 9, 2, 0.25, 0.5, round % 3 == 0};
    model::ExistenceState state{40, 2, 3, {}, std::string("\0model\xff", 7), {}};
    for (std::size_t i = 0; i < make.count(); ++i) {
      existence.landmarks.push_back({10 + 3 * i, 0.5, i % 2 == 0});
      state.landmarks.push_back(existence.landmarks.back());
      state.states += std::string("\0\x01\xff", 3);
    }
    check_round_trip(existence);
    check_round_trip(state);

    auto damaged = to_wire(state);
    damaged.model.front() = 7;
    CHECK(from_wire(damaged).refusal().reason == Reason::kInconsistent);
    existence.landmarks = {{5, 0.5, true}, {5, 0.5, true}};
    CHECK(from_wire(to_wire(existence)).refusal().reason == Reason::kInconsistent);
    existence.landmarks = {{5, 1.5, true}};
    CHECK_FALSE(from_wire(to_wire(existence)));
  }
}

TEST_CASE("sensor values survive the wire") {
  const geometry::SE2 vehicle_T_sensor(3.6, -0.2, 0.1);
  model::PlanarScan scan{
      100, 5, -1.5, 0.01, 80.0, {1.0F, 0.0F, 90.0F, 80.5F}, 1e-4, vehicle_T_sensor};
  const auto back = decode_message<model::PlanarScan>(encode_message(scan));
  REQUIRE(back);
  CHECK(back->ranges_m == std::vector<float>{1.0F, 0.0F, 0.0F, 0.0F});
  CHECK(back->bearing(1) == Approx(scan.bearing(1)));
  CHECK(back->end() == 400);
  CHECK(back->vehicle_T_sensor.coordinates().isApprox(vehicle_T_sensor.coordinates()));
  check_round_trip(model::WheelSample{3, 4, 1.5, -0.2});
  check_round_trip(model::GnssFix{3, 4, {10.0, -20.0}, 0.0, std::nullopt, 0.0});
  check_round_trip(model::GnssFix{3, 4, {10.0, -20.0}, 2.0, Eigen::Vector2d(1.0, 2.0), 0.1});
  gnss_t none = to_wire(model::GnssFix{3, 4, {10.0, -20.0}, 0.0, std::nullopt, 0.0});
  none.valid = 0;
  CHECK_FALSE(from_wire(none));
}

TEST_CASE("the front end's values survive the wire") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Maker make(seed);
    check_round_trip(model::ImuSample{3, 4, make.vector<3>(1.0), make.vector<3>(10.0)});
    check_round_trip(model::RawPose{3, 4, make.pose(), make.covariance<3>(), seed % 2 == 0});
    check_round_trip(model::EkfPose{3, 4, make.pose(), make.covariance<3>(), make.vector<2>(5.0),
                                    make.covariance<2>(), make.vector<3>(0.1), make.covariance<3>(),
                                    7, 1, 2});
    check_round_trip(model::VelocityCorrection{3, 4, make.vector<2>(5.0), make.vector<3>(0.1),
                                               make.covariance<5>()});
    check_round_trip(
        model::EkfLevel{3, 4, make.vector<2>(0.01), make.covariance<2>(), make.covariance<2>()});
    check_round_trip(model::RestLevel{9, 4, 3, 8, make.vector<2>(0.01), make.covariance<2>(),
                                      make.covariance<2>()});
    model::EkfMap map{3, 4, {}};

    model::TrackedScan tracked{3, 4, {40.0, 0.1, 2.0}, {}};
    for (std::size_t i = make.count(); i > 0; --i) {
      map.landmarks.push_back({i, make.vector<2>(50.0), make.covariance<2>(), 0.2, make.kind(), 9});
    }

    std::uint32_t index = 0;
    for (const model::Detection& detection : make.scan().detections) {
      tracked.landmarks.push_back({100 + index, index, detection});
      ++index;
    }

    check_round_trip(map);
    check_round_trip(tracked);
    for (const double farthest_m : {0.5, 30.0, 32.768, 120.0}) {
      check_round_trip(make.sweep(farthest_m));
    }
  }
}

TEST_CASE("a sweep's points keep their places to half a step") {
  Maker make(3);
  const model::PointSweep sweep = make.sweep(120.0);
  const auto back = decode_message<model::PointSweep>(encode_message(sweep));
  REQUIRE(back);
  REQUIRE(back->points.size() == sweep.points.size());

  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    CHECK((back->points[i].position() - sweep.points[i].position()).cwiseAbs().maxCoeff() <=
          2.1e-3F);
    CHECK(std::abs(back->points[i].time_s - sweep.points[i].time_s) <= 2.1e-6F);
    CHECK(back->points[i].ring == sweep.points[i].ring);
    CHECK(back->points[i].intensity == sweep.points[i].intensity);
  }

  model::PointSweep broken = sweep;
  broken.points[7].y_m = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(to_wire(broken), std::invalid_argument);
  broken.points[7].y_m = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS(to_wire(broken), std::invalid_argument);
}

TEST_CASE("a sweep that cannot be is refused") {
  Maker make(3);
  lidar_sweep_t wire = to_wire(make.sweep(30.0));
  REQUIRE(from_wire(wire));
  wire.ring[3] = 32;
  CHECK_FALSE(from_wire(wire));
  wire.ring[3] = 31;
  wire.part = wire.parts;
  CHECK_FALSE(from_wire(wire));
}

TEST_CASE("a sweep in parts is put together again, and one with a hole is dropped") {
  Maker make(8);
  model::PointSweep whole = make.sweep(30.0);
  whole.part = 0;
  whole.parts = 1;
  model::SweepAssembler assembler;
  const auto turn = [&whole] {
    ++whole.revolution;
    whole.utime += 100'000;
  };

  for (std::size_t size = 1; size <= 45; ++size) {
    turn();
    const std::vector<model::PointSweep> parts = split_sweep(whole, size);
    REQUIRE(parts.size() == (whole.points.size() + size - 1) / size);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const auto result = assembler.add(parts[i]);
      REQUIRE(result.has_value() == (i + 1 == parts.size()));
      if (result) CHECK(encode_message(*result) == encode_message(whole));
    }
  }

  CHECK(assembler.incomplete_revolutions() == 0);
  const std::size_t count = split_sweep(whole, 10).size();
  for (std::size_t lost = 0; lost < count; ++lost) {
    turn();
    std::vector<model::PointSweep> parts = split_sweep(whole, 10);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (i != lost) CHECK_FALSE(assembler.add(parts[i]));
    }
    turn();
    parts = split_sweep(whole, 10);
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) CHECK_FALSE(assembler.add(parts[i]));
    CHECK(assembler.add(parts.back()));
  }

  CHECK(assembler.incomplete_revolutions() == count);
}

TEST_CASE("values are carried field by field") {
  Maker make(5);
  model::LandmarkScan scan = make.scan();
  while (scan.detections.empty()) scan = make.scan();
  const auto back = decode_message<model::LandmarkScan>(encode_message(scan));
  REQUIRE(back);
  CHECK(back->sequence == scan.sequence);
  CHECK(back->field_of_view.bearing_rad == scan.field_of_view.bearing_rad);
  CHECK(back->detections[0].position_m == scan.detections[0].position_m);
  CHECK(back->detections[0].covariance_m2 == scan.detections[0].covariance_m2);
  CHECK(back->detections[0].kind == scan.detections[0].kind);
}

TEST_CASE("a scan is refused for each thing that cannot be") {
  CHECK(from_wire(scan_with_one()));
  auto scan = scan_with_one();
  scan.detections[0].kind = 2;
  CHECK(reason_of(scan) == Reason::kOutOfRange);
  scan = scan_with_one();
  scan.detections[0].position_m[1] = 1e9;
  CHECK(reason_of(scan) == Reason::kOutOfRange);

  scan = scan_with_one();
  scan.detections[0].radius_m = -0.1;
  CHECK(reason_of(scan) == Reason::kOutOfRange);
  scan = scan_with_one();
  scan.max_range_m = -1.0;
  CHECK(reason_of(scan) == Reason::kOutOfRange);
  scan = scan_with_one();

  scan.detections[0].covariance_m2[0][1] = 0.005;
  CHECK(reason_of(scan) == Reason::kNotSymmetric);
  scan = scan_with_one();
  scan.detections[0].covariance_m2[0][0] = -0.01;
  CHECK(reason_of(scan) == Reason::kNotPositive);
  scan = scan_with_one();
  scan.detections[0].covariance_m2[0][1] = scan.detections[0].covariance_m2[1][0] = 0.011;

  CHECK(reason_of(scan) == Reason::kNotPositive);
}

TEST_CASE("a keyframe without members, or with members out of order, is refused") {
  Maker make(1);
  model::Keyframe keyframe = make.keyframe();
  keyframe.members.resize(1);
  keyframe.detections.clear();
  keyframe2_t wire = to_wire(keyframe);
  REQUIRE(from_wire(wire));
  wire.members.push_back(wire.members[0]);
  wire.num_members = 2;
  CHECK(from_wire(wire).refusal().reason == Reason::kInconsistent);
  wire.members.clear();
  wire.num_members = 0;
  CHECK(from_wire(wire).refusal().reason == Reason::kInconsistent);
}

TEST_CASE("positive semidefinite agrees with the eigenvalues, whatever the scales") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  int positive = 0;

  for (int i = 0; i < 2000; ++i) {
    Eigen::Matrix3d matrix;
    for (int k = 0; k < 9; ++k) matrix(k) = normal(random);
    matrix = (0.5 * (matrix + matrix.transpose())).eval();
    matrix += 2.0 * std::abs(normal(random)) * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d eigenvalues =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues();
    if (eigenvalues.cwiseAbs().minCoeff() < 1e-3) continue;

    const bool expected = eigenvalues.minCoeff() > 0.0;
    positive += expected ? 1 : 0;
    const Eigen::Vector3d scale(1e-3, 1.0, 1e3);
    CHECK(is_positive_semidefinite(matrix) == expected);
    CHECK(is_positive_semidefinite(scale.asDiagonal() * matrix * scale.asDiagonal()) == expected);
  }

  CHECK(positive > 200);
  CHECK(is_positive_semidefinite(Eigen::Matrix3d::Zero()));
}
