// What holds for every maker's lasers: points and samples come back as they were put into packets,
// and packets that are damaged, missing or of another model do no harm.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/io/data_error.hpp"
#include "common/packets/survey.hpp"
#include "tests/catch.hpp"
#include "tests/packets/made_up_sensor.hpp"

using namespace understory;
using namespace understory::packets;
using namespace understory::test;

namespace {

constexpr model::Utime kStart = 1'790'000'123'456'789;

struct Decoded {
  std::vector<model::PointSweep> sweeps;
  std::vector<model::ImuSample> imu;
  StreamCounts counts;
};

Decoded decode(const SensorDescription& sensor, const std::vector<SentPacket>& packets,
               model::Utime delay = 200) {
  Decoder decoder = make_decoder(sensor);
  Decoded decoded;
  for (const SentPacket& packet : packets) {
    Readings readings = add(decoder, {packet.bytes, packet.sent + delay});
    for (auto& sweep : readings.sweeps) decoded.sweeps.push_back(std::move(sweep));
    for (const auto& sample : readings.imu) decoded.imu.push_back(sample);
  }
  if (auto sweep = finish(decoder)) decoded.sweeps.push_back(*std::move(sweep));
  decoded.counts = counts(decoder);
  return decoded;
}

/// In order of time and ring, as sweeps are.
void order(std::vector<TruePoint>& points) {
  std::ranges::stable_sort(points, [](const TruePoint& a, const TruePoint& b) {
    return a.time_ns < b.time_ns || (a.time_ns == b.time_ns && a.ring < b.ring);
  });
}

bool is_at(const model::SweepPoint& point, const TruePoint& truth, double tolerance_m) {
  return (point.position().cast<double>() - truth.position_m).norm() < tolerance_m &&
         point.ring == truth.ring && point.intensity == truth.intensity;
}

/// Points of one time and ring (two returns) may stand in either order.
void check_sweep(model::PointSweep sweep, std::vector<TruePoint> truth, double tolerance_m) {
  order(truth);
  std::ranges::stable_sort(sweep.points, [](const auto& a, const auto& b) {
    return a.time_s < b.time_s || (a.time_s == b.time_s && a.ring < b.ring);
  });
  REQUIRE(sweep.points.size() == truth.size());
  std::size_t misplaced = 0;
  std::size_t mistimed = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double time_ns = 1e9 * static_cast<double>(sweep.points[i].time_s) +
                           static_cast<double>((sweep.utime * 1000) - truth[i].time_ns);
    mistimed += std::abs(time_ns) < 1100.0 ? 0 : 1;
    // A microsecond's rounding may have swapped neighbours.
    const std::size_t from = i < 80 ? 0 : i - 80;
    const std::size_t to = std::min(i + 81, truth.size());
    misplaced += std::any_of(sweep.points.begin() + static_cast<long>(from),
                             sweep.points.begin() + static_cast<long>(to),
                             [&](const auto& p) { return is_at(p, truth[i], tolerance_m); })
                     ? 0
                     : 1;
  }
  CHECK(misplaced == 0);
  CHECK(mistimed == 0);
}

}  // namespace

TEST_CASE("points and samples come back as they were sent", "[packets]") {
  std::mt19937_64 random(1);
  for (const MadeUpSensor& sensor : made_up_sensors()) {
    CAPTURE(sensor.name);
    const MadeUpRecording recording = sensor.record(2, kStart, random);
    const Decoded decoded = decode(sensor.description, recording.packets);
    CHECK(decoded.counts.refused == 0);
    CHECK(decoded.counts.gaps == 0);
    CHECK(decoded.counts.jumps == 0);
    CHECK(decoded.counts.sweeps == decoded.sweeps.size());
    REQUIRE(decoded.sweeps.size() == recording.sweeps.size());
    for (std::size_t s = 0; s < decoded.sweeps.size(); ++s) {
      CHECK(decoded.sweeps[s].revolution == decoded.sweeps[0].revolution + s);
      check_sweep(decoded.sweeps[s], recording.sweeps[s], sensor.tolerance_m);
      // Velodyne's points are in order of their rings within a firing.
      if (sensor.description.model != "vlp16")
        CHECK(std::ranges::is_sorted(decoded.sweeps[s].points, {}, &model::SweepPoint::time_s));
    }

    REQUIRE(decoded.imu.size() == recording.imu.size());
    for (std::size_t i = 0; i < decoded.imu.size(); ++i) {
      CHECK(decoded.imu[i].utime == recording.imu[i].utime);
      CHECK(
          decoded.imu[i].specific_force_mps2.isApprox(recording.imu[i].specific_force_mps2, 1e-6));
      CHECK(decoded.imu[i].angular_rate_rad_s.isApprox(recording.imu[i].angular_rate_rad_s, 1e-6));
    }
  }
}

TEST_CASE("metadata of another mode of an Ouster are noticed, not believed", "[packets]") {
  std::mt19937_64 random(21);
  for (const MadeUpSensor& sensor : {made_up_ousters()[0], made_up_ousters()[1]}) {
    const MadeUpRecording recording = sensor.record(6, kStart, random);
    for (const int columns : {1024, 2048}) {
      packets::SensorDescription other = sensor.description;
      const auto replace = [&](const std::string& behind, const std::string& text,
                               const std::string& by) {
        const std::size_t at = other.description.find(text, other.description.find(behind));
        REQUIRE(at != std::string::npos);
        other.description.replace(at, text.size(), by);
      };
      replace("columns_per_frame", "512", std::to_string(columns));
      replace("column_window", "511", std::to_string(columns - 1));
      replace("lidar_mode", "512x", std::to_string(columns) + "x");
      const Decoded decoded = decode(other, recording.packets);
      CAPTURE(sensor.name, columns);
      CHECK(decoded.sweeps.empty());
      CHECK(decoded.counts.refused > decoded.counts.packets / 2);
    }
  }
}

TEST_CASE("a sensor's clock that counts from power-on is moved onto the computer's", "[packets]") {
  std::mt19937_64 random(2);
  for (const MadeUpSensor& sensor : one_of_each_family()) {
    if (sensor.description.model == "vlp16") continue;  // tells the microseconds of the hour alone
    CAPTURE(sensor.name);
    constexpr model::Utime kSincePowerOn = 3'600'000'000;
    MadeUpRecording recording = sensor.record(2, kSincePowerOn, random);
    const Decoded decoded = decode(sensor.description, recording.packets, kStart - kSincePowerOn);
    REQUIRE(decoded.sweeps.size() == 2);
    // The first packet has the time at which it came.
    const model::Utime first = recording.sweeps[0].front().time_ns / 1000;
    CHECK(std::abs(decoded.sweeps[0].utime - (kStart - kSincePowerOn) - first) < 20'000);
    CHECK(std::abs(decoded.sweeps[1].utime - decoded.sweeps[0].utime - 100'000) < 1000);

    // TAI instead of UTC is a time of day, too.
    recording = sensor.record(1, kStart, random);
    const Decoded ahead = decode(sensor.description, recording.packets, -37'000'000);
    REQUIRE(ahead.sweeps.size() == 1);
    CHECK(std::abs(ahead.sweeps[0].utime - recording.sweeps[0].front().time_ns / 1000) < 1000);
  }
}

TEST_CASE("a clock that is set loses one sweep and mixes no times", "[packets]") {
  std::mt19937_64 random(3);
  for (const MadeUpSensor& sensor : one_of_each_family()) {
    if (sensor.description.model == "vlp16") continue;
    CAPTURE(sensor.name);
    MadeUpRecording before = sensor.record(2, 5'000'000'000, random);
    MadeUpRecording after = sensor.record(2, kStart, random);
    for (SentPacket& packet : before.packets) packet.sent += kStart - 5'001'000'000;
    auto packets = before.packets;
    packets.insert(packets.end(), after.packets.begin(), after.packets.end());
    const Decoded decoded = decode(sensor.description, packets);
    CHECK(decoded.counts.jumps == 1);
    CHECK(decoded.sweeps.size() >= 3);
    for (const auto& sweep : decoded.sweeps) {
      CHECK(sweep.points.back().time_s < 0.11F);
      CHECK(std::abs(sweep.utime - kStart) < 2'000'000);  // placed anew
    }
  }
}

TEST_CASE("damaged packets are refused or decoded, never more", "[packets]") {
  std::mt19937_64 random(4);
  for (const MadeUpSensor& sensor : made_up_sensors()) {
    CAPTURE(sensor.name);
    const MadeUpRecording recording = sensor.record(1, kStart, random);
    std::uint64_t refused = 0;
    for (int trial = 0; trial < 20; ++trial) {
      auto packets = recording.packets;
      for (SentPacket& packet : packets) {
        if (random() % 4 != 0) continue;
        switch (random() % 3) {
          case 0:
            packet.bytes.resize(random() % (packet.bytes.size() + 1));
            break;
          case 1:
            packet.bytes.resize(packet.bytes.size() + 1 + random() % 2000);
            break;
          default:
            for (int k = 0; k < 8; ++k)
              packet.bytes[random() % packet.bytes.size()] = static_cast<std::uint8_t>(random());
        }
      }
      const Decoded decoded = decode(sensor.description, packets);
      refused += decoded.counts.refused;
      for (const auto& sweep : decoded.sweeps) {
        REQUIRE(std::ranges::all_of(sweep.points, [&](const auto& point) {
          return point.position().allFinite() && point.time_s >= 0.0F && point.ring < sweep.rings;
        }));
      }
    }
    CHECK(refused > 20);
  }
}

TEST_CASE("packets of another model are refused", "[packets]") {
  std::mt19937_64 random(5);
  const auto sensors = made_up_sensors();
  for (const MadeUpSensor& sensor : one_of_each_family()) {
    Decoder decoder = make_decoder(sensor.description);
    for (const MadeUpSensor& other : sensors) {
      if (other.description.model == sensor.description.model) continue;
      if (livox_model(other.description.model) && livox_model(sensor.description.model)) continue;
      CAPTURE(sensor.name, other.name);
      for (const SentPacket& packet : other.record(1, kStart, random).packets) {
        if (packet.bytes.size() == kOusterImuBytes) continue;  // nothing marks these
        const Readings readings = add(decoder, {packet.bytes, packet.sent});
        REQUIRE(readings.fault);
        REQUIRE(readings.sweeps.empty());
        REQUIRE(readings.imu.empty());
      }
    }
  }
}

TEST_CASE("packets that are missing are counted and leave a hole", "[packets]") {
  std::mt19937_64 random(6);
  for (const MadeUpSensor& sensor : made_up_sensors()) {
    CAPTURE(sensor.name);
    const MadeUpRecording recording = sensor.record(3, kStart, random);
    auto packets = recording.packets;
    // Those at the middle of the second sweep; longer than the widest step of an azimuth.
    const model::Utime from = recording.sweeps[1].front().time_ns / 1000 + 20'000;
    std::erase_if(packets, [&](const SentPacket& packet) {
      return packet.sent > from && packet.sent < from + 5'000;
    });
    const Decoded decoded = decode(sensor.description, packets);
    CHECK(decoded.counts.gaps >= 1);
    REQUIRE(decoded.sweeps.size() == 3);
    CHECK(decoded.sweeps[1].points.size() < recording.sweeps[1].size());
    CHECK(decoded.sweeps[1].points.size() > recording.sweeps[1].size() / 2);
    CHECK(decoded.sweeps[2].points.size() == recording.sweeps[2].size());
  }
}

TEST_CASE("the limit of the range holds for every family", "[packets]") {
  std::mt19937_64 random(7);
  for (const MadeUpSensor& sensor : one_of_each_family()) {
    CAPTURE(sensor.name);
    const MadeUpRecording recording = sensor.record(1, kStart, random);
    SensorDescription description = sensor.description;
    description.max_range_m = 15.0;
    const Decoded decoded = decode(description, recording.packets);
    REQUIRE(decoded.sweeps.size() == 1);
    const auto expected = std::ranges::count_if(
        recording.sweeps[0], [](const TruePoint& point) { return point.position_m.norm() < 15.0; });
    CHECK(decoded.sweeps[0].max_range_m == 15.0);
    // Ouster's and Velodyne's ranges count from beside the origin.
    CHECK(std::abs(static_cast<double>(decoded.sweeps[0].points.size()) -
                   static_cast<double>(expected)) < 0.02 * static_cast<double>(expected));
    for (const auto& point : decoded.sweeps[0].points) REQUIRE(point.position().norm() < 15.3F);
  }
}

TEST_CASE("packets are recognised as what they are", "[packets]") {
  std::mt19937_64 random(8);
  for (const MadeUpSensor& sensor : made_up_sensors()) {
    CAPTURE(sensor.name);
    for (const SentPacket& sent : sensor.record(1, kStart, random).packets) {
      io::CapturedPacket packet;
      packet.payload = sent.bytes;
      packet.port = sent.port;
      const Recognised recognised = recognise(packet);
      const auto livox = livox_model(sensor.description.model);
      const bool is_plain = sensor.name.starts_with("mid70 data type 0") ||
                            sensor.name.starts_with("mid70 data type 1");
      // Of SDK1 the types of packets tell no more.
      const std::string expected =
          livox && speaks_sdk1(*livox) && !is_plain ? "avia" : sensor.description.model;
      REQUIRE(recognised.model == expected);
      REQUIRE(recognised.kind != Kind::kUnknown);
    }
  }
  for (int i = 0; i < 2000; ++i) {
    io::CapturedPacket noise;
    noise.port = static_cast<std::uint16_t>(random());
    noise.payload.resize(random() % 2000);
    for (auto& byte : noise.payload) byte = static_cast<std::uint8_t>(random());
    if (noise.payload.size() == 48 || noise.port == kOusterLidarPort) continue;
    if (ouster_format({"LEGACY"}, 16, 16).packet == noise.payload.size()) continue;
    REQUIRE(recognise(noise).kind == Kind::kUnknown);
  }
}

TEST_CASE("descriptions that cannot be are refused by name", "[packets]") {
  const auto problem = [](const SensorDescription& sensor) -> std::string {
    try {
      make_decoder(sensor);
    } catch (const io::DataError& error) {
      return error.what();
    }
    return {};
  };
  using Catch::Matchers::Contains;
  CHECK_THAT(problem({"os1", "", ""}), Contains("\"os1\" is none of vlp16"));
  CHECK_THAT(problem({"ouster", "", ""}), Contains("metadata"));
  CHECK_THAT(problem({"ouster", "{", "a.json"}), Contains("a.json: no JSON object"));
  CHECK_THAT(problem({"mid360", "x", "a.txt"}), Contains("a.txt"));
  CHECK_THAT(problem({"vlp16", "x", "a.txt"}), Contains("a.txt"));
  CHECK_THAT(problem({"hdl64e", "", ""}), Contains("hdl64e"));
  CHECK_THAT(problem({"xt32", "x", "a.csv"}), Contains("a.csv: no heading"));
  const std::string heading = "Laser id,Elevation,Azimuth\n";
  CHECK_THAT(problem({"xt32", heading + "1,2,3\n", "a.csv"}), Contains("31 of 32 channels"));
  CHECK_THAT(problem({"xt32", heading + "33,2,3\n", "a.csv"}), Contains("a.csv, line 2"));
  CHECK_THAT(problem({"xt32", heading + "1,x,3\n", "a.csv"}), Contains("a.csv, line 2"));
}

TEST_CASE("every model that is named is known, and some need a file") {
  std::stringstream names(known_models());
  std::size_t count = 0;
  for (std::string model; std::getline(names, model, ',');) {
    model.erase(0, model.find_first_not_of(' '));
    CAPTURE(model);
    ++count;
    std::string refused;
    try {
      make_decoder({model, "", "none.txt"});
    } catch (const io::DataError& error) {
      refused = error.what();
    }
    CHECK_THAT(refused, !Catch::Matchers::Contains("is none of"));
  }
  CHECK(count >= 16);
  CHECK_THROWS_WITH(make_decoder({"vlp17", "", ""}), Catch::Matchers::Contains("is none of"));
}
