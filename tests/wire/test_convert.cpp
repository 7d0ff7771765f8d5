// Values -> wire -> values is the identity, and what comes in is checked.
#include <Eigen/Eigenvalues>
#include <numbers>
#include <random>

#include "common/wire/checks.hpp"
#include "tests/catch.hpp"
#include "tests/wire/all_types.hpp"

using namespace understory;
using namespace understory::wire;

namespace {

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed) {}
  double real(double scale) {
    return std::uniform_real_distribution<double>(-scale, scale)(random_);
  }
  std::size_t count() { return random_() % 6; }
  template <int N>
  Eigen::Matrix<double, N, N> covariance() {
    Eigen::Matrix<double, N, N> root;
    for (int i = 0; i < N * N; ++i) root(i) = real(0.3);
    const Eigen::Matrix<double, N, N> product = root * root.transpose();
    return 0.5 * (product + product.transpose());
  }
  geometry::SE2 pose() { return {real(100.0), real(100.0), real(3.0)}; }
  model::LandmarkKind kind() { return static_cast<model::LandmarkKind>(random_() % 2); }

  model::LandmarkScan scan() {
    model::LandmarkScan scan{1000, 7, {40.0, real(1.0), 3.0}, {}};
    for (std::size_t i = count(); i > 0; --i) {
      scan.detections.push_back({{real(40.0), real(40.0), real(2.0)},
                                 covariance<3>(),
                                 real(0.1) + 0.2,
                                 kind(),
                                 real(3.0),
                                 0.02});
    }
    return scan;
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector(double scale) {
    Eigen::Matrix<double, N, 1> result;
    for (int i = 0; i < N; ++i) result[i] = real(scale);
    return result;
  }
  model::Odometry odometry() {
    model::Odometry odometry{5,           10,         2, pose(), covariance<3>(), std::nullopt,
                             count() > 2, count() > 2};
    if (count() < 3) return odometry;

    model::Preintegration inertial;
    inertial.seconds = 0.1;
    inertial.yaw_rad = real(1.0);
    inertial.velocity_mps = vector<2>(3.0);
    inertial.position_m = vector<2>(1.0);
    inertial.covariance = covariance<5>();
    inertial.level = {covariance<2>(), Eigen::Matrix2d::Identity(), covariance<2>(), real(0.1)};
    inertial.level.memory(0, 1) = real(1.0);
    for (int i = 0; i < 15; ++i) inertial.bias_jacobian(i) = real(1.0);
    inertial.bias = vector<3>(0.1);
    odometry.inertial = inertial;

    return odometry;
  }
  model::PointSweep sweep(double farthest_m) {
    model::PointSweep sweep;
    sweep.utime = 1000;
    sweep.revolution = 7;
    sweep.part = static_cast<std::uint16_t>(count());
    sweep.parts = 8;
    sweep.is_deskewed = count() > 2;
    sweep.rings = 32;
    sweep.max_range_m = 100.0;
    sweep.sensor_position_m = vector<3>(2.0);
    if (count() > 2) {
      model::Attitude attitude;
      attitude.level_Q_vehicle = Eigen::AngleAxisd(0.1, vector<3>(1.0).normalized());
      attitude.covariance_rad2 = covariance<2>();
      sweep.attitude = attitude;
    }

    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector3f p = vector<3>(farthest_m).cast<float>();
      sweep.points.push_back({p.x(), p.y(), p.z(), static_cast<float>(real(0.1)),
                              static_cast<std::uint16_t>(random_() % 32),
                              static_cast<std::uint8_t>(random_() % 256)});
    }

    return sweep;
  }
  model::Keyframe keyframe() {
    model::Keyframe keyframe{1000, 3, {40.0, 0.0, 2.0 * std::numbers::pi}, {}, {}, std::nullopt};
    if (count() > 2) keyframe.previous_T_base = pose();
    for (std::size_t i = 0; i <= count(); ++i) {
      keyframe.members.push_back(
          {static_cast<model::Utime>(1000 + 100 * i), 50 + i, pose(), covariance<3>()});
    }
    for (std::size_t i = count(); i > 0; --i) {
      keyframe.landmarks.push_back(
          {{real(40.0), real(40.0)}, covariance<2>(), 0.2, static_cast<std::uint16_t>(i), kind()});
    }
    return keyframe;
  }
  model::MapLandmark landmark() {
    return {random_() | 1U, {real(400.0), real(400.0)}, covariance<2>(), 0.2, 9, kind()};
  }
  std::vector<model::MapLandmark> landmarks() {
    std::vector<model::MapLandmark> result(count());
    for (model::MapLandmark& one : result) one = landmark();
    return result;
  }

 private:
  std::mt19937_64 random_;
};

/// Sent and received again; the same value encodes to the same bytes.
template <class T>
void check_round_trip(const T& value) {
  const Bytes bytes = encode_message(value);
  const auto back = decode_message<T>(bytes);
  INFO((back ? "" : back.refusal().detail));
  REQUIRE(back);
  CHECK(encode_message(*back) == bytes);
}

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

TEST_CASE("values survive the wire") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Maker make(seed);
    check_round_trip(make.scan());
    check_round_trip(make.keyframe());
    check_round_trip(make.odometry());
    check_round_trip(model::SlamPose{10, 2, model::MapUpdateStatus::kUpdated, 4, 0, make.pose(),
                                     make.covariance<3>(), 3, make.pose(), make.pose(), 1,
                                     make.pose()});
    check_round_trip(model::SlamPose{10, 2, std::nullopt, std::nullopt, 0, make.pose(),
                                     make.covariance<3>(), 3, make.pose(), make.pose(), 1,
                                     make.pose()});
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
    check_round_trip(update);
  }
}

TEST_CASE("sensor values survive the wire") {
  model::PlanarScan scan{100, 5, -1.5, 0.01, 80.0, {1.0F, 0.0F, 90.0F, 80.5F}};
  const auto back = decode_message<model::PlanarScan>(encode_message(scan));
  REQUIRE(back);
  CHECK(back->ranges_m == std::vector<float>{1.0F, 0.0F, 0.0F, 0.0F});
  CHECK(back->bearing(1) == Approx(scan.bearing(1)));
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

  for (std::size_t size = 1; size <= 45; ++size) {
    const std::vector<model::PointSweep> parts = split_sweep(whole, size);
    REQUIRE(parts.size() == (whole.points.size() + size - 1) / size);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const auto result = assembler.add(parts[i]);
      REQUIRE(result.has_value() == (i + 1 == parts.size()));
      if (result) CHECK(encode_message(*result) == encode_message(whole));
    }
  }

  CHECK(assembler.incomplete_revolutions() == 0);
  const std::vector<model::PointSweep> parts = split_sweep(whole, 10);
  for (std::size_t lost = 0; lost < parts.size(); ++lost) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (i != lost) CHECK_FALSE(assembler.add(parts[i]));
    }
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) CHECK_FALSE(assembler.add(parts[i]));
    CHECK(assembler.add(parts.back()));
  }

  CHECK(assembler.incomplete_revolutions() == parts.size());
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
  keyframe_t wire = to_wire(keyframe);
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
