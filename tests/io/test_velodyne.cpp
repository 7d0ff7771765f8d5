#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/io/packet_capture.hpp"
#include "common/io/velodyne.hpp"
#include "common/io/velodyne_fixes.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"
#include "tests/io/velodyne_packets.hpp"

using namespace understory;
using namespace understory::io;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::vector<model::PointSweep> turns_of(VelodyneDecoder& decoder, test::PacketMaker maker,
                                        int packets) {
  std::vector<model::PointSweep> turns;
  for (int i = 0; i < packets; ++i) {
    const auto received = static_cast<model::Utime>(7'200'000'000.0 + maker.time_us);
    if (auto turn = decoder.add(maker.next(), received)) turns.push_back(*std::move(turn));
  }
  return turns;
}

}  // namespace

TEST_CASE("a revolution of the VLP-16 is where its beams point", "[velodyne]") {
  VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16));
  const auto turns = turns_of(decoder, {.azimuth = 35000}, 230);
  REQUIRE(turns.size() == 3);
  const model::PointSweep& turn = turns.front();
  CHECK(turn.rings == 16);
  CHECK(turn.points.size() == 900 * 32);
  CHECK(turn.utime >= 7'200'000'000);

  CHECK(turn.utime < 7'200'100'000);
  float last = 0.0F;
  for (const model::SweepPoint& p : turn.points) {
    const double elevation = (2.0 * p.ring - 15.0) * kDegree;
    const double flat = std::hypot(p.x_m, p.y_m);
    CHECK(std::abs(flat - 10.0 * std::cos(elevation)) < 0.02);
    CHECK(std::abs(p.z_m - 10.0 * std::sin(elevation)) < 0.02);
    // The laser rotates clockwise by 0.4 degrees in two firings.
    double azimuth = -std::atan2(p.y_m, p.x_m) / kDegree;
    if (azimuth < -0.5) azimuth += 360.0;
    const double expected = azimuth / 0.4 * 110.592e-6;
    CHECK(std::abs(std::remainder(p.time_s - expected, 900 * 110.592e-6)) < 4e-5);
    CHECK(p.time_s >= last - 4e-5F);
    last = std::max(last, p.time_s);
  }
}

TEST_CASE("points at the limit of the range and beyond are left out", "[velodyne]") {
  // All at 10 m; the correction of single beams is zero.
  for (const double limit_m : {2.5, 9.99, 10.0, 10.01, 40.0}) {
    VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16), limit_m);
    std::size_t points = 0;
    for (const auto& turn : turns_of(decoder, {.azimuth = 35000}, 230))
      points += turn.points.size();
    CHECK((points > 0) == (limit_m > 10.0));
  }
}

TEST_CASE("models tell their beams apart", "[velodyne]") {
  const VelodyneCalibration hdl32 = velodyne_calibration(VelodyneModel::kHdl32e);
  CHECK(hdl32.beams[0].elevation_rad == Approx(-30.6667 * kDegree).epsilon(1e-4));
  CHECK(hdl32.beams[31].elevation_rad == Approx(10.6667 * kDegree).epsilon(1e-4));

  for (const VelodyneModel model :
       {VelodyneModel::kVlp16, VelodyneModel::kVlp32c, VelodyneModel::kHdl32e}) {
    const VelodyneCalibration calibration = velodyne_calibration(model);
    CHECK(velodyne_model(to_string(model)) == model);
    std::vector<double> by_ring(calibration.beams.size());
    for (std::size_t i = 0; i < by_ring.size(); ++i)
      by_ring[calibration.rings[i]] = calibration.beams[i].elevation_rad;
    CHECK(std::ranges::is_sorted(by_ring, std::ranges::less_equal{}));
  }

  CHECK_THROWS_AS(velodyne_calibration(VelodyneModel::kHdl64e), DataError);
  CHECK_FALSE(velodyne_model("os1"));
}

TEST_CASE("dual returns give both points, and one where they are the same", "[velodyne]") {
  VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16));
  const auto turns = turns_of(decoder, {.dual = true, .azimuth = 35000}, 400);
  REQUIRE(turns.size() >= 2);
  CHECK(turns[0].points.size() == 2 * 900 * 32);
  int far = 0;
  for (const model::SweepPoint& p : turns[0].points) far += p.position().norm() > 10.5F;
  CHECK(far == 900 * 32);
}

TEST_CASE("the 32 beam models decode", "[velodyne]") {
  VelodyneDecoder vlp32(velodyne_calibration(VelodyneModel::kVlp32c));
  auto turns = turns_of(vlp32, {.product = 0x28, .azimuth = 35000, .azimuth_step = 20}, 400);
  REQUIRE(!turns.empty());
  CHECK(turns[0].points.size() == 1800 * 32);
  CHECK(turns[0].points[0].position().norm() == Approx(20.0).epsilon(1e-3));
  VelodyneDecoder hdl32(velodyne_calibration(VelodyneModel::kHdl32e));
  turns = turns_of(hdl32, {.product = 0x21, .azimuth = 35000, .azimuth_step = 20}, 400);
  REQUIRE(!turns.empty());
  CHECK(turns[0].rings == 32);
}

TEST_CASE("the HDL-64E decodes with its own calibration", "[velodyne]") {
  const VelodyneCalibration calibration = parse_hdl64_calibration(test::hdl64_yaml(), "db.yaml");
  CHECK(calibration.rings[0] == 63);
  CHECK(calibration.rings[63] == 0);
  VelodyneDecoder decoder(calibration);
  const auto turns = turns_of(
      decoder,
      {.hdl64 = true, .product = 0, .azimuth = 35000, .azimuth_step = 20, .packet_us = 288.0}, 500);
  REQUIRE(!turns.empty());
  CHECK(turns[0].points.size() == 1800 * 64);

  for (const model::SweepPoint& p : turns[0].points)
    CHECK(p.position().norm() == Approx(11.2).epsilon(0.002));
  CHECK_THROWS_AS(parse_hdl64_calibration("lasers:\n", "db.yaml"), DataError);
  CHECK_THROWS_AS(parse_hdl64_calibration(test::hdl64_yaml().substr(0, 3000), "db.yaml"),
                  DataError);
  std::string xml = "<boost_serialization>";

  for (int i = 0; i < 64; ++i)
    xml += "<item><px><id_>" + std::to_string(i) + "</id_><rotCorrection_>1.5</rotCorrection_>" +
           "<vertCorrection_>" + std::to_string(2.0 - 0.4 * i) + "</vertCorrection_>" +
           "<distCorrection_>120</distCorrection_></px></item>";

  const VelodyneCalibration from_xml = parse_hdl64_calibration(xml, "db.xml");
  CHECK(from_xml.beams[3].distance_correction_m == Approx(1.2));
  CHECK(from_xml.beams[0].elevation_rad == Approx(2.0 * kDegree));
}

TEST_CASE("packets that are none are refused", "[velodyne]") {
  VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16));
  test::PacketMaker maker;
  const test::Packet good = maker.next();
  std::mt19937_64 random(1);
  for (std::size_t size = 0; size < good.size(); size += 7)
    CHECK_FALSE(decoder.add({good.data(), size}, 0));
  const auto refused = decoder.counts().refused;
  CHECK(refused == decoder.counts().packets);

  test::Packet other = good;
  other[1205] = 0x21;
  decoder.add(other, 0);
  CHECK(decoder.counts().refused == refused + 1);

  for (int i = 0; i < 20000; ++i) {
    test::Packet noisy = good;
    for (int k = 0; k < 20; ++k)
      noisy[random() % noisy.size()] = static_cast<std::uint8_t>(random());
    if (const auto turn = decoder.add(noisy, static_cast<model::Utime>(random() >> 12U))) {
      for (const model::SweepPoint& p : turn->points) {
        REQUIRE(p.position().allFinite());
        REQUIRE(p.time_s >= 0.0F);
      }
    }
  }
}

TEST_CASE("NMEA sentences are read when their checksum is right", "[velodyne]") {
  const std::string good = "$GPRMC,081801,A,3642.7250,N,00426.3880,W,010.0,090.0,210116,,,A*6A";
  const auto star = good.find('*');
  unsigned sum = 0;
  for (const char c : good.substr(1, star - 1)) sum ^= static_cast<unsigned char>(c);
  char digits[3];
  std::snprintf(digits, sizeof digits, "%02X", sum);
  const std::string sentence = good.substr(0, star + 1) + digits;

  const auto position = parse_gprmc(sentence);
  REQUIRE(position);
  CHECK(position->is_valid);
  CHECK(position->latitude_deg == Approx(36.0 + 42.725 / 60.0));
  CHECK(position->longitude_deg == Approx(-(4.0 + 26.388 / 60.0)));
  CHECK(position->speed_mps == Approx(5.14444).epsilon(1e-4));
  CHECK(position->day_us == (8 * 3600 + 18 * 60 + 1) * 1'000'000LL);

  for (std::size_t i = 0; i < sentence.size(); ++i) {
    parse_gprmc(std::string_view(sentence).substr(0, i));
    std::string changed = sentence;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    CHECK_FALSE(parse_gprmc(changed));
  }
}

TEST_CASE("a fix moves where its course points", "[velodyne]") {
  VelodyneFixes fixes;
  VelodynePosition position;
  position.is_valid = true;
  position.speed_mps = 3.0;
  for (int degrees = 0; degrees < 360; degrees += 15) {
    position.day_us += 1'000'000;
    position.course_rad = degrees * kDegree;
    const auto fix = fixes.add(position, 5);
    REQUIRE((fix && fix->velocity_mps));
    CHECK(fix->velocity_mps->norm() == Approx(3.0));
    // From north, clockwise: the vector (east, north) as a complex number turns the other way.
    const double bearing = std::atan2(fix->velocity_mps->y(), fix->velocity_mps->x());
    CHECK(std::abs(std::remainder(bearing + (degrees - 90) * kDegree, 360 * kDegree)) < 1e-9);
  }
  CHECK_FALSE(fixes.add(position, 6));  // The same instant again.
}

TEST_CASE("a recorded capture of a VLP-16", "[velodyne][recorded]") {
  const fs::path file = test::recording("lidar_packets/velodyne_vlp16_gps.pcap");
  PacketCapture capture(file);
  VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16));
  std::vector<model::PointSweep> turns;
  int positions = 0;

  while (const auto packet = capture.next()) {
    if (packet->port == kVelodynePositionPort)
      positions += parse_velodyne_position(packet->payload).has_value();
    if (packet->port != kVelodyneDataPort) continue;
    if (auto turn = decoder.add(packet->payload, packet->utime)) turns.push_back(*std::move(turn));
  }

  CHECK(decoder.counts().packets == 293);
  CHECK(decoder.counts().refused == 0);
  CHECK(positions > 0);
  REQUIRE(turns.size() >= 2);

  for (const model::PointSweep& turn : turns) {
    CHECK(turn.points.size() > 10'000);
    CHECK(turn.points.back().time_s == Approx(0.1).margin(0.005));
    for (const model::SweepPoint& p : turn.points) {
      const double elevation = std::atan2(p.z_m, std::hypot(p.x_m, p.y_m));
      // Near the laser the beams' offsets show.
      CHECK(std::abs(elevation - (2.0 * p.ring - 15.0) * kDegree) <
            0.001 + 0.012 / p.position().norm());
    }
  }

  CHECK(std::abs(turns[1].utime - turns[0].utime - 100'000) < 3'000);
}

TEST_CASE("VLP-16 packets inside a foreign LCM log", "[velodyne][recorded]") {
  const fs::path file = test::recording("lcm_logs/gokart_vlp16_rimo.lcm");
  LcmLogReader reader(file);
  VelodyneDecoder decoder(velodyne_calibration(VelodyneModel::kVlp16));
  std::vector<model::PointSweep> turns;

  while (const auto event = reader.next()) {
    if (event->channel != "vlp16.center.ray") continue;
    const std::span<const std::uint8_t> data(event->data);
    if (auto turn = decoder.add(data.last(kVelodyneDataBytes), event->utime))
      turns.push_back(*std::move(turn));
  }

  CHECK(decoder.counts().refused == 0);
  CHECK(decoder.counts().packets == 120);
  REQUIRE(!turns.empty());
  CHECK(turns.front().points.size() > 5'000);
}
