// Bags through the command: where the sensors sit on the vehicle, its speed and turn rate, the axes
// of its IMU.
#include <cmath>
#include <random>

#include "tests/catch.hpp"
#include "tests/cli/bag_folder.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

constexpr double kWheelbase_m = 2.7;

}  // namespace

TEST_CASE("import bag: mounts that /tf repeats, speed of a twist", "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    messages.push_back(imu_at(now, now));
    // As a publisher of static transforms does that knows no /tf_static.
    const std::vector<bag::Pose> transforms{
        frame_in("base_link", "imu", place(0.5, 0.0, 1.0)),
        frame_in("odom", "base_link", place(0.1 * static_cast<double>(i), 0.0, 0.0))};
    messages.push_back({"/tf", "tf2_msgs/TFMessage", now, transforms_message(cdr, transforms)});
    bag::Odometry odometry;
    odometry.pose.header = {now, "base_link"};
    odometry.velocity_mps.x() = 3.0;
    messages.push_back(
        {"/twist", "geometry_msgs/TwistStamped", now, twist_message(cdr, odometry, false)});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  CHECK_THAT(folder.import(bag, "--list").out,
             Contains("mount: imu on base_link: x 0.500 y 0.000 z 1.000 m") &&
                 Contains("--odometry /twist"));
  const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
  CHECK_THAT(outcome.out, Contains("20 wheel samples") && Contains("x_m = 0.500000"));
  CHECK(outcome.error.empty());
  folder.refused(bag, "--odometry /twist --speed-from-pose",
                 "geometry_msgs/TwistStamped has no pose");
}

TEST_CASE("import bag: a transform that is none costs no other one, two values are both told",
          "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  bag::Pose broken = frame_in("base_link", "camera", place(1.0, 2.0, 3.0));
  broken.pose.translation().y() = std::nan("");
  const std::vector<bag::Pose> first{broken, frame_in("base_link", "imu", place(0.5, 0.0, 1.0)),
                                     frame_in("base_link", "mast", place(0.0, 0.0, 1.0))};
  // The same again is no contradiction.
  const std::vector<bag::Pose> second{frame_in("base_link", "imu", place(0.7, 0.0, 1.0, 0.5)),
                                      frame_in("base_link", "mast", place(0.0, 0.0, 1.0))};
  const std::string bag = folder.write(
      {BagForm::Kind::kMcap},
      {{"/tf_static", "tf2_msgs/TFMessage", kStart_ns, transforms_message(cdr, first)},
       {"/tf_static", "tf2_msgs/TFMessage", kStart_ns + 1, transforms_message(cdr, second)},
       imu_at(kStart_ns + 2, kStart_ns + 2)});
  const std::string of_camera = "camera in base_link: a transform whose numbers are no pose";
  const std::string of_imu =
      "imu: two static transforms, in base_link at (0.500, 0.000, 1.000) m, roll 0.00 pitch 0.00 "
      "yaw 0.00 deg and later in base_link at (0.700, 0.000, 1.000) m, roll 0.00 pitch 0.00 yaw "
      "28.65 deg: the later one counts";
  CHECK_THAT(folder.import(bag, "--list").out, Contains(of_camera) && Contains(of_imu));
  const Outcome outcome = folder.import(bag, "--out " + folder.path("run.lcm"));
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("x_m = 0.700000\nz_m = 1.000000\nyaw_rad = 0.500000"));
  CHECK_THAT(outcome.error, Contains(of_camera) && Contains(of_imu));
  CHECK(lines(outcome.error) == 2);
}

TEST_CASE("import bag: the velocity of a frame becomes that of the vehicle", "[import]") {
  const BagFolder folder;
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const Serialisation cdr{bag::Encoding::kCdr, false};
  // A frame on the vehicle, turned and beside its origin; the vehicle drives and turns.
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d vehicle_T_frame =
        place(2.0 * number(random), number(random), 1.0, 3.0 * number(random));
    const double speed_mps = 3.0 + number(random);
    const Eigen::Vector3d rate_rad_s(0.0, 0.0, 0.3 * number(random));
    const Eigen::Vector3d there_mps =
        Eigen::Vector3d(speed_mps, 0.0, 0.0) + rate_rad_s.cross(vehicle_T_frame.translation());
    bag::Odometry odometry;
    odometry.pose.header = {kStart_ns, "gps"};
    odometry.velocity_mps = vehicle_T_frame.linear().transpose() * there_mps;
    odometry.angular_rate_rad_s = rate_rad_s;
    const std::vector<bag::Pose> mounts(1, frame_in("base_link", "gps", vehicle_T_frame));
    const std::vector<Recorded> messages{
        {"/tf_static", "tf2_msgs/TFMessage", kStart_ns, transforms_message(cdr, mounts)},
        {"/twist", "geometry_msgs/TwistStamped", kStart_ns, twist_message(cdr, odometry, false)}};
    const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
    const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
    REQUIRE(outcome.status == 0);
    auto channels = channels_of(folder.path("run.lcm"));
    const auto wheels = wire::decode_message<model::WheelSample>(channels["RAW_WHEELS"].at(0));
    REQUIRE(wheels);
    CHECK(wheels->speed_mps == Approx(speed_mps).margin(1e-9));
    CHECK(wheels->steering_rad ==
          Approx(std::atan(kWheelbase_m * rate_rad_s.z() / speed_mps)).margin(1e-9));

    folder.refused(bag, "--odometry /twist --mount lasr=1,2,3",
                   "--mount lasr: no such frame; the bag has base_link, gps");
    odometry.velocity_mps.x() = std::nan("");
    const std::string damaged = folder.write(
        {BagForm::Kind::kMcap},
        {{"/twist", "geometry_msgs/TwistStamped", kStart_ns, twist_message(cdr, odometry, false)}});
    folder.refused(damaged, "--odometry /twist", "/twist, message 1: a velocity that is no number");
  }
}

TEST_CASE("import bag: turns on the spot and sideways motion, which no car makes, are told",
          "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  const auto drive = [&](std::int64_t count, const Eigen::Vector3d& velocity_mps, double rate) {
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t now = kStart_ns + static_cast<std::int64_t>(messages.size()) * 100'000'000;
      bag::Odometry odometry;
      odometry.pose.header = {now, "base_link"};
      odometry.velocity_mps = velocity_mps;
      odometry.angular_rate_rad_s.z() = rate;
      messages.push_back(
          {"/twist", "geometry_msgs/TwistStamped", now, twist_message(cdr, odometry, false)});
    }
  };
  // Standstill with the gyro's noise, and a curve with slip: as a car drives.
  drive(2, {0.0, 0.0, 0.0}, 0.01);
  drive(3, {5.0, 0.05, 0.0}, 0.3);
  const auto remarks = [&] {
    const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
    const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
    REQUIRE(outcome.status == 0);
    return outcome.error;
  };
  CHECK(remarks().empty());

  drive(4, {0.0, 0.0, 0.0}, -0.5);
  drive(5, {0.0, 1.0, 0.0}, 0.0);
  drive(6, {0.05, -1.0, 0.0}, 0.5);
  const std::string said = remarks();
  CHECK_THAT(said, Contains("/twist: 10 of 20 messages turn by more than 0.02 rad/s at 0.1 m/s"));
  CHECK_THAT(said, Contains("/twist: 11 of 20 messages move sideways by more than 0.1 m/s"));
  CHECK(channels_of(folder.path("run.lcm"))["RAW_WHEELS"].size() == 20);
}

TEST_CASE("import bag --list: an IMU in g, upside down, tilted, without gravity", "[import]") {
  const BagFolder folder;
  const auto listed = [&](const Eigen::Vector3d& force) {
    const MessageBytes message =
        imu_message({bag::Encoding::kCdr, false}, {{kStart_ns, "base_link"}, {0, 0, 0}, force});
    const std::string bag =
        folder.write({BagForm::Kind::kMcap}, {{"/imu", "sensor_msgs/Imu", kStart_ns, message},
                                              {"/imu", "sensor_msgs/Imu", kStart_ns + 1, message}});
    return folder.import(bag, "--list").out;
  };
  CHECK_THAT(listed({0, 0, 9.8}), Contains("(0.00, 0.00, 9.80) m/s^2\n"));
  CHECK_THAT(listed({0, 0, 1.0}), Contains("in g"));
  CHECK_THAT(listed({0, 0, 0.1}), Contains("gravity is missing"));
  CHECK_THAT(listed({0, 0, -9.8}), Contains("points down"));
  CHECK_THAT(listed({9.8, 0, 0.3}), Contains("points sideways"));
}
