// Messages in ROS 1's serialisation and in CDR of both byte orders.
#include <zstd.h>

#include <functional>
#include <random>

#include "common/bag/messages.hpp"
#include "common/bag/static_transforms.hpp"
#include "common/bag/survey.hpp"
#include "common/io/data_error.hpp"
#include "common/io/velodyne.hpp"
#include "tests/bag/message_writer.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

const std::vector<Serialisation> kSerialisations{
    {bag::Encoding::kRos1, false}, {bag::Encoding::kCdr, false}, {bag::Encoding::kCdr, true}};

using Random = std::mt19937_64;

double uniform(Random& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

Eigen::Vector3d random_vector(Random& random) {
  return {uniform(random, -9, 9), uniform(random, -9, 9), uniform(random, -9, 9)};
}

Eigen::Isometry3d random_pose(Random& random) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(uniform(random, -1, 1), uniform(random, -1, 1),
                                     uniform(random, -1, 1), uniform(random, 0.1, 1))
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = random_vector(random);
  return pose;
}

bag::Header random_header(Random& random) {
  // Lengths of all remainders: what follows is aligned anew.
  return {static_cast<std::int64_t>(random() % 2'000'000'000'000'000'000),
          std::string(random() % 9, 'f')};
}

void check_header(const bag::Header& found, const bag::Header& wanted) {
  CHECK(found.stamp_ns == wanted.stamp_ns);
  CHECK(found.frame == wanted.frame);
}

/// Every cut of the message is an error; nothing else happens.
void check_cuts(const Serialisation& how, const MessageBytes& bytes, std::size_t ignored_at_end,
                const std::function<void(bag::MessageReader&)>& read) {
  for (std::size_t size = 0; size + ignored_at_end < bytes.size(); ++size) {
    CAPTURE(size);
    // A copy of that size: reading behind it is noticed by the sanitizer.
    const MessageBytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    CHECK_THROWS_AS(
        [&] {
          bag::MessageReader reader(cut, how.encoding);
          read(reader);
        }(),
        io::DataError);
  }
}

constexpr const char* kVelodyne = "velodyne_msgs/VelodyneScan";

/// Every version of the messages, each read without being told which it is.
void check_hesai_scans(Random& random, const Serialisation& how) {
  std::vector<MessageBytes> payloads;
  for (std::size_t i = 0; i < 1 + random() % 4; ++i)
    payloads.emplace_back(568 + random() % 900, static_cast<std::uint8_t>(random()));
  bag::PacketScan scan{random_header(random), {}};
  for (const MessageBytes& payload : payloads)
    scan.packets.push_back({1000 + static_cast<std::int64_t>(scan.packets.size()), payload});

  const auto check = [&](const std::string& type, bool has_header, std::size_t fixed_bytes) {
    const MessageBytes bytes = scan_message(how, scan, has_header, fixed_bytes);
    CAPTURE(type, has_header, fixed_bytes);
    const bag::MessageReader reader(bytes, how.encoding);
    const bag::PacketScan found = read_packets(reader, type);
    REQUIRE(found.packets.size() == payloads.size());
    if (has_header) CHECK(found.header.stamp_ns == scan.header.stamp_ns);
    for (std::size_t i = 0; i < payloads.size(); ++i) {
      CHECK(found.packets[i].stamp_ns == scan.packets[i].stamp_ns);
      CHECK(std::ranges::equal(found.packets[i].bytes, payloads[i]));
    }
    const MessageBytes shorter(bytes.begin(), bytes.end() - 5);
    const bag::MessageReader cut(shorter, how.encoding);
    CHECK_THROWS_WITH(read_packets(cut, type), Catch::Matchers::Contains("no packets"));
  };
  for (const char* type : {"pandar_msgs/PandarScan", "hesai_lidar/PandarScan"}) {
    check(type, true, 0);
    check(type, true, 1500);
  }
  check("hesai_ros_driver/UdpFrame", true, 0);
  check("hesai_ros_driver/UdpFrame", false, 0);
}

TEST_CASE("bag messages: IMU, odometry, fix and poses come back") {
  Random random(1);
  for (int round = 0; round < 30; ++round) {
    for (const Serialisation& how : kSerialisations) {
      CAPTURE(round, static_cast<int>(how.encoding), how.is_big_endian);
      bag::Imu imu{random_header(random), random_vector(random), random_vector(random)};
      const MessageBytes imu_bytes = imu_message(how, imu);
      bag::MessageReader imu_reader(imu_bytes, how.encoding);
      const bag::Imu imu_found = read_imu(imu_reader);
      check_header(imu_found.header, imu.header);
      CHECK(imu_found.angular_rate_rad_s == imu.angular_rate_rad_s);
      CHECK(imu_found.specific_force_mps2 == imu.specific_force_mps2);

      bag::Odometry odometry{
          {random_header(random), std::string(random() % 9, 'c'), random_pose(random)},
          random_vector(random),
          random_vector(random)};
      const MessageBytes odometry_bytes = odometry_message(how, odometry);
      bag::MessageReader odometry_reader(odometry_bytes, how.encoding);
      const bag::Odometry odometry_found = read_odometry(odometry_reader, "nav_msgs/Odometry");
      check_header(odometry_found.pose.header, odometry.pose.header);
      CHECK(odometry_found.pose.child_frame == odometry.pose.child_frame);
      CHECK(odometry_found.pose.pose.isApprox(odometry.pose.pose, 1e-12));
      CHECK(odometry_found.velocity_mps == odometry.velocity_mps);
      CHECK(odometry_found.angular_rate_rad_s == odometry.angular_rate_rad_s);
      for (const bool has_covariance : {false, true}) {
        const MessageBytes bytes = twist_message(how, odometry, has_covariance);
        bag::MessageReader reader(bytes, how.encoding);
        const bag::Odometry twist =
            read_odometry(reader, has_covariance ? "geometry_msgs/TwistWithCovarianceStamped"
                                                 : "geometry_msgs/TwistStamped");
        check_header(twist.pose.header, odometry.pose.header);
        CHECK(twist.velocity_mps == odometry.velocity_mps);
        CHECK(twist.angular_rate_rad_s == odometry.angular_rate_rad_s);
      }
      bag::MessageReader as_pose(odometry_bytes, how.encoding);
      CHECK(read_pose(as_pose, "nav_msgs/Odometry").pose.isApprox(odometry.pose.pose, 1e-12));

      bag::NavSatFix fix{random_header(random),      round % 2 == 0, uniform(random, -90, 90),
                         uniform(random, -180, 180), 400.0,          1.5};
      const MessageBytes fix_bytes = fix_message(how, fix);
      bag::MessageReader fix_reader(fix_bytes, how.encoding);
      const bag::NavSatFix fix_found = read_nav_sat_fix(fix_reader);
      check_header(fix_found.header, fix.header);
      CHECK(fix_found.has_fix == fix.has_fix);
      CHECK(fix_found.latitude_deg == fix.latitude_deg);
      CHECK(fix_found.longitude_deg == fix.longitude_deg);
      CHECK(fix_found.sigma_m == 1.5);

      if (round > 2) continue;
      check_cuts(how, imu_bytes, 9 * 8, [](auto& reader) { read_imu(reader); });
      check_cuts(how, odometry_bytes, 36 * 8,
                 [](auto& reader) { read_odometry(reader, "nav_msgs/Odometry"); });
      check_cuts(how, fix_bytes, 0, [](auto& reader) { read_nav_sat_fix(reader); });
    }
  }
}

TEST_CASE("bag messages: scans and transforms come back") {
  Random random(2);
  for (int round = 0; round < 10; ++round) {
    for (const Serialisation& how : kSerialisations) {
      CAPTURE(round, static_cast<int>(how.encoding), how.is_big_endian);
      model::PlanarScan scan;
      scan.first_bearing_rad = -1.5;
      scan.bearing_step_rad = 0.25;
      scan.beam_interval_s = 0.0078125;
      scan.max_range_m = 30.0;
      scan.ranges_m = {1.0F,          0.01F, std::numeric_limits<float>::infinity(),
                       std::nanf(""), 29.0F, -1.0F};
      const bag::Header header = random_header(random);
      const MessageBytes scan_bytes = scan_message(how, header, scan);
      bag::MessageReader scan_reader(scan_bytes, how.encoding);
      const bag::LaserScan scan_found = read_laser_scan(scan_reader);
      check_header(scan_found.header, header);
      CHECK(scan_found.scan.first_bearing_rad == -1.5);
      CHECK(scan_found.scan.bearing_step_rad == 0.25);
      CHECK(scan_found.scan.beam_interval_s == 0.0078125);
      CHECK(scan_found.scan.max_range_m == 30.0);
      CHECK(scan_found.scan.ranges_m == std::vector<float>{1.0F, 0.0F, 0.0F, 0.0F, 29.0F, 0.0F});

      std::vector<bag::Pose> transforms(random() % 4);
      for (auto& t : transforms)
        t = {random_header(random), std::string(random() % 9, 'c'), random_pose(random)};
      const MessageBytes tf_bytes = transforms_message(how, transforms);
      bag::MessageReader tf_reader(tf_bytes, how.encoding);
      const auto tf_found = read_transforms(tf_reader);
      REQUIRE(tf_found.size() == transforms.size());
      for (std::size_t i = 0; i < transforms.size(); ++i) {
        CHECK(tf_found[i].child_frame == transforms[i].child_frame);
        CHECK(tf_found[i].pose.isApprox(transforms[i].pose, 1e-12));
      }

      if (round > 0) continue;
      check_cuts(how, scan_bytes, 4, [](auto& reader) { read_laser_scan(reader); });
      check_cuts(how, tf_bytes, 0, [](auto& reader) { read_transforms(reader); });
    }
  }
}

TEST_CASE("bag messages: Livox clouds and packets come back") {
  Random random(4);
  for (int round = 0; round < 10; ++round) {
    for (const Serialisation& how : kSerialisations) {
      CAPTURE(round, static_cast<int>(how.encoding), how.is_big_endian);
      bag::LivoxCloud cloud{random_header(random), 12345, {}};
      for (std::uint32_t i = 0; i < 5; ++i)
        cloud.points.push_back(
            {i * 1000, random_vector(random).cast<float>(), 9, static_cast<std::uint8_t>(i)});
      const MessageBytes livox_bytes = livox_message(how, cloud);
      bag::MessageReader livox_reader(livox_bytes, how.encoding);
      const bag::LivoxCloud livox_found = read_livox_cloud(livox_reader);
      CHECK(livox_found.base_ns == 12345);
      REQUIRE(livox_found.points.size() == 5);
      for (std::size_t i = 0; i < 5; ++i) {
        CHECK(livox_found.points[i].offset_ns == cloud.points[i].offset_ns);
        CHECK(livox_found.points[i].position_m == cloud.points[i].position_m);
        CHECK(livox_found.points[i].reflectivity == 9);
        CHECK(livox_found.points[i].line == i);
      }

      MessageWriter packets(how);
      packets.header(random_header(random)).number(std::uint32_t{2});
      for (std::uint8_t i = 0; i < 2; ++i)
        packets.stamp(77 + i).raw(MessageBytes(io::kVelodyneDataBytes, i));
      bag::MessageReader packet_reader(packets.bytes(), how.encoding);
      const bag::PacketScan packets_found = read_packets(packet_reader, kVelodyne);
      REQUIRE(packets_found.packets.size() == 2);
      CHECK(packets_found.packets[1].stamp_ns == 78);
      CHECK(packets_found.packets[1].bytes.size() == io::kVelodyneDataBytes);
      CHECK(packets_found.packets[1].bytes[1205] == 1);

      check_hesai_scans(random, how);

      if (round > 0) continue;
      check_cuts(how, livox_bytes, 0, [](auto& reader) { read_livox_cloud(reader); });
      check_cuts(how, packets.bytes(), 0, [](auto& reader) { read_packets(reader, kVelodyne); });
    }
  }
}

TEST_CASE("bag messages: lengths that cannot be, and CDR of other kinds, are refused") {
  MessageWriter writer({bag::Encoding::kCdr, false});
  writer.header({0, ""}).number(std::uint32_t{1}).number(std::uint32_t{1}).number(0xffffffffU);
  bag::MessageReader reader(writer.bytes(), bag::Encoding::kCdr);
  CHECK_THROWS_WITH(read_point_cloud(reader), Catch::Matchers::Contains("4294967295 elements"));

  MessageBytes parameter_list{0, 3, 0, 0, 1, 2, 3, 4};
  CHECK_THROWS_AS(bag::MessageReader(parameter_list, bag::Encoding::kCdr), io::DataError);
  // Plain CDR of version 2 aligns to four bytes at most.
  const MessageBytes second{0, 7, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f};
  bag::MessageReader of_second(second, bag::Encoding::kCdr);
  CHECK(of_second.number<std::uint32_t>() == 1);
  CHECK(of_second.number<double>() == 1.0);
}

TEST_CASE("bag messages: those that rosbag2 packed one by one are unpacked") {
  const Serialisation how{bag::Encoding::kCdr, false};
  const MessageBytes plain = imu_message(how, {{77, "imu"}, {1, 2, 3}, {4, 5, 6}});
  MessageBytes packed(ZSTD_compressBound(plain.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 3));
  bag::MessageReader reader(packed, bag::Encoding::kCdr);
  CHECK(read_imu(reader).specific_force_mps2 == Eigen::Vector3d(4, 5, 6));
  packed.pop_back();
  CHECK_THROWS_WITH(bag::MessageReader(packed, bag::Encoding::kCdr),
                    Catch::Matchers::Contains("zstd"));
}

TEST_CASE("bag messages: static transforms join along any chain") {
  Random random(3);
  const auto link = [&](const std::string& parent, const std::string& child) {
    return bag::Pose{{0, parent}, child, random_pose(random)};
  };
  const auto base_imu = link("base_link", "imu");
  const auto base_mast = link("base_link", "mast");
  const auto mast_laser = link("mast", "laser");
  bag::StaticTransforms transforms;
  for (const auto& one : {mast_laser, base_imu, base_mast}) transforms.add(one);
  CHECK(transforms.find("base_link", "laser")->isApprox(base_mast.pose * mast_laser.pose, 1e-12));
  CHECK(transforms.find("imu", "laser")
            ->isApprox(base_imu.pose.inverse() * base_mast.pose * mast_laser.pose, 1e-12));
  CHECK(transforms.find("laser", "laser")->isApprox(Eigen::Isometry3d::Identity()));
  CHECK_FALSE(transforms.find("base_link", "camera"));
  CHECK(transforms.has("mast"));

  // What /tf repeats counts where it stays, unless /tf_static has it.
  const auto radar = link("base_link", "radar");
  auto moving = link("odom", "base_link");
  for (int i = 0; i < 5; ++i) {
    moving.pose.translation().x() += 0.1;
    for (const auto& one : {radar, moving, link("mast", "laser")}) transforms.watch(one);
  }
  CHECK(transforms.take_watched() == 1);
  CHECK(transforms.find("base_link", "radar")->isApprox(radar.pose, 1e-12));
  CHECK_FALSE(transforms.has("odom"));
  CHECK(transforms.find("mast", "laser")->isApprox(mast_laser.pose, 1e-12));

  // A circle ends.
  transforms.add(link("laser", "base_link"));
  transforms.find("base_link", "camera");
}

}  // namespace
}  // namespace understory::test
