// Bags through the command: clocks that differ, messages without a stamp.
#include "tests/catch.hpp"
#include "tests/cli/bag_folder.hpp"
#include "understory/lidar_scan_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

TEST_CASE("import bag: clocks that differ are named and laid onto the recorder's", "[import]") {
  const BagFolder folder;
  std::vector<Recorded> messages;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    messages.push_back(imu_at(now, now - 2'000'000));
    // A sensor that counts from when it was switched on.
    model::PlanarScan scan;
    scan.bearing_step_rad = 0.1;
    scan.max_range_m = 30.0;
    scan.ranges_m = {1.0F, 2.0F};
    messages.push_back({"/scan", "sensor_msgs/LaserScan", now,
                        scan_message(cdr, {i * 100'000'000 + 50'000'000'000, "laser"}, scan)});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  const std::string out = " --out " + folder.path("run.lcm");
  CHECK_THAT(folder.import(bag, "--list").out, Contains("--receive-time /scan"));
  CHECK_THAT(folder.import(bag, out).error, Contains("--receive-time /scan"));
  const Outcome mended = folder.import(bag, "--receive-time /scan" + out);
  REQUIRE(mended.status == 0);
  CHECK_THAT(mended.error, !Contains("--receive-time"));
  const auto scans = channels_of(folder.path("run.lcm"))["RAW_SCAN"];
  REQUIRE(scans.size() == 20);
  lidar_scan_t scan{};
  scan.decode(scans[3].data(), 0, static_cast<int>(scans[3].size()));
  CHECK(std::abs(scan.utime - (kStart_ns / 1000 + 300'000)) < 1000);
  folder.refused(bag, "--receive-time /none", "no such topic");
}

TEST_CASE("import bag: stamps of 0 are refused, or are the times of reception", "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    // A sender that knows its clock only after a while, and one that never does.
    messages.push_back(imu_at(now, i < 5 ? 0 : now));
    messages.push_back(
        {"/odom", "nav_msgs/Odometry", now,
         odometry_message(cdr,
                          {{{0, "odom"}, "base_link", place(0.2 * static_cast<double>(i), 0, 0)},
                           {0, 0, 0},
                           {0, 0, 0}})});
    model::PointSweep sweep;
    sweep.has_times = true;
    for (int k = 1; k < 100; ++k) {
      model::SweepPoint point;
      point.x_m = static_cast<float>(k);
      point.time_s = 1e-3F * static_cast<float>(k);
      sweep.points.push_back(point);
    }
    std::vector<std::uint8_t> data;
    messages.push_back({"/points", "sensor_msgs/PointCloud2", now,
                        cloud_message(cdr, cloud_of({0, "laser"}, sweep, data))});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  const std::string odometry = "--odometry /odom --speed-from-pose ";
  const std::string of_imu =
      "/imu: the stamp of 5 of 20 messages is 0: --receive-time /imu takes the time of reception";
  CHECK_THAT(folder.import(bag, "--list").out, Contains(of_imu) && Contains("no stamp"));
  folder.refused(
      bag, "--cloud none",
      "/imu, message 1: its stamp is 0: --receive-time /imu takes the time of reception");
  folder.refused(bag, "--imu none", "/points, message 1: its stamp is 0: --receive-time /points");
  folder.refused(bag, odometry + "--imu none --cloud none", "/odom, message 1: its stamp is 0");

  const Outcome outcome = folder.import(
      bag, odometry + "--receive-time /imu --receive-time /points --receive-time /odom --out " +
               folder.path("run.lcm"));
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.error, !Contains("stamp"));
  auto channels = channels_of(folder.path("run.lcm"));
  const auto utime_of = [&](const char* channel, std::size_t i, auto example) {
    const auto message = wire::decode_message<decltype(example)>(channels[channel].at(i));
    REQUIRE(message);
    return message->utime;
  };
  const auto sweeps = sweeps_of(folder.path("run.lcm"));
  REQUIRE(sweeps.size() == 20);
  for (std::int64_t i = 0; i < 20; ++i) {
    const model::Utime received = kStart_ns / 1000 + i * 100'000;
    const auto at = static_cast<std::size_t>(i);
    CHECK(utime_of("RAW_IMU", at, model::ImuSample{}) == received);
    CHECK(sweeps[at].utime == received);
    if (i > 0) CHECK(utime_of("RAW_WHEELS", at - 1, model::WheelSample{}) == received);
  }
  const auto wheels = wire::decode_message<model::WheelSample>(channels["RAW_WHEELS"].at(3));
  CHECK(wheels.value().speed_mps == Approx(2.0));
}
