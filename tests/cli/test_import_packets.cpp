// Captures of every maker's lasers through the command, and what it says of those it cannot import.
#include <random>

#include "common/packets/decoder.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/io/capture_file.hpp"
#include "tests/packets/made_up_sensor.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

constexpr model::Utime kCaptureStart = 1'790'000'123'456'789;
constexpr std::uint32_t kLaser = 0xC0A801C9;  // 192.168.1.201

struct CaptureFixture {
  TemporaryDirectory directory;
  std::filesystem::path capture = directory / "drive.pcap";
  std::filesystem::path log = directory / "drive.lcm";
  std::mt19937_64 random{17};

  /// The options that the import needs.
  std::string describe(const MadeUpSensor& sensor) {
    // The packets of Livox's SDK1 lasers are the same.
    const auto livox = packets::livox_model(sensor.description.model);
    if (livox && packets::speaks_sdk1(*livox)) return " --model " + sensor.description.model;
    if (sensor.description.description.empty()) return {};
    const auto file = directory / sensor.description.source;
    std::ofstream(file) << sensor.description.description;
    return " --metadata " + file.string();
  }
  MadeUpRecording write(const MadeUpSensor& sensor, const CaptureStyle& style = {}) {
    const MadeUpRecording recording = sensor.record(2, kCaptureStart, random);
    CaptureFile file(style);
    for (const SentPacket& packet : recording.packets)
      file.add(packet.sent + 200, kLaser, packet.port, packet.bytes);
    write_bytes(capture, file.bytes());
    return recording;
  }
  Outcome import(const std::string& more = "") {
    return understory_command(directory,
                              "import pcap " + capture.string() + " --out " + log.string() + more);
  }
};

/// What a decoder makes of the packets without files, as the log's messages.
std::vector<Bytes> messages_of(const MadeUpSensor& sensor, const MadeUpRecording& recording) {
  packets::Decoder decoder = make_decoder(sensor.description);
  std::vector<Bytes> messages;
  const auto write = [&](const model::PointSweep& sweep) {
    for (model::PointSweep& part : split_sweep(sweep, 4000)) {
      part.sequence = messages.size();
      messages.push_back(wire::encode_message(part));
    }
  };
  for (const SentPacket& packet : recording.packets) {
    for (const auto& sweep : add(decoder, {packet.bytes, packet.sent + 200}).sweeps) write(sweep);
  }
  if (const auto sweep = finish(decoder)) write(*sweep);
  return messages;
}

std::vector<Bytes> logged(const std::filesystem::path& file, const std::string& channel) {
  io::LcmLogReader reader(file);
  std::vector<Bytes> messages;
  for (const auto& event : read_log(reader)) {
    if (event.channel == channel) messages.push_back(event.data);
  }
  return messages;
}

}  // namespace

TEST_CASE("a capture of any maker's laser becomes its sweeps and samples", "[cli][packets]") {
  CaptureFixture fixture;
  const auto styles = capture_styles();
  std::size_t number = 0;
  for (const MadeUpSensor& sensor : made_up_sensors()) {
    CAPTURE(sensor.name);
    const MadeUpRecording recording = fixture.write(sensor, styles[number++ % styles.size()]);
    const Outcome outcome = fixture.import(fixture.describe(sensor));
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
    CHECK_THAT(outcome.out, Contains(sensor.description.model + " at 192.168.1.201: 2 sweeps"));
    CHECK_THAT(outcome.out, Contains("(0 refused, 0 gaps)"));
    CHECK(logged(fixture.log, "RAW_SWEEP") == messages_of(sensor, recording));
    CHECK(logged(fixture.log, "RAW_IMU").size() == recording.imu.size());
  }
}

TEST_CASE("an Ouster's metadata are found beside the capture, or asked for", "[cli][packets]") {
  CaptureFixture fixture;
  const MadeUpSensor sensor = made_up_ousters().front();
  fixture.write(sensor);
  const Outcome without = fixture.import();
  CHECK(without.status == 1);
  CHECK_THAT(without.error, Contains("drive.pcap") && Contains("--metadata FILE.json"));

  std::ofstream(fixture.directory / "drive.json") << sensor.description.description;
  const Outcome with = fixture.import();
  CHECK(with.status == 0);
  CHECK_THAT(with.out, Contains("ouster at"));

  // Metadata of another sensor: none of the packets fit.
  const auto other = fixture.describe(made_up_ousters()[1]);
  const Outcome wrong = fixture.import(other);
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.error, Contains("drive.pcap") && Contains("not one whole sweep"));
}

TEST_CASE("a capture that is not known is described", "[cli][packets]") {
  CaptureFixture fixture;
  CaptureFile file;
  for (int i = 0; i < 10; ++i) file.add(kCaptureStart + i, kLaser, 6699, Bytes(1248, 0x55));
  write_bytes(fixture.capture, file.bytes());
  const Outcome outcome = fixture.import();
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error, Contains("no point packets of a laser that is known"));
  CHECK_THAT(outcome.error, Contains("192.168.1.201") && Contains("6699") && Contains("1248"));
  CHECK_FALSE(std::filesystem::exists(fixture.log));

  const Outcome list =
      understory_command(fixture.directory, "import pcap --list " + fixture.capture.string());
  CHECK(list.status == 0);
  CHECK_THAT(list.out, Contains("6699") && Contains("not known"));
  const Outcome neither =
      understory_command(fixture.directory, "import pcap " + fixture.capture.string());
  CHECK(neither.status == 2);
}

TEST_CASE("of two lasers one is chosen by its address", "[cli][packets]") {
  CaptureFixture fixture;
  const MadeUpSensor sensor = made_up_livoxes().front();
  const MadeUpRecording recording = sensor.record(2, kCaptureStart, fixture.random);
  CaptureFile file;
  for (const SentPacket& packet : recording.packets) {
    file.add(packet.sent + 200, kLaser, packet.port, packet.bytes);
    file.add(packet.sent + 201, kLaser + 1, packet.port, packet.bytes);
  }
  write_bytes(fixture.capture, file.bytes());
  const Outcome both = fixture.import();
  CHECK(both.status == 1);
  CHECK_THAT(both.error, Contains("--sensor ADDRESS") && Contains("192.168.1.202"));
  const Outcome one = fixture.import(" --sensor 192.168.1.202");
  CHECK(one.status == 0);
  CHECK(logged(fixture.log, "RAW_SWEEP") == messages_of(sensor, recording));
}

TEST_CASE("tables take the place of what the laser itself gives", "[cli][packets]") {
  CaptureFixture fixture;
  const MadeUpRecording recording = fixture.write(made_up_livoxes().front());
  std::ofstream(fixture.directory / "imu.csv")
      << "t_us,gx,gy,gz,ax,ay,az\n1790000123500000,0,0,0.25,0,0,9.8\n";
  std::ofstream(fixture.directory / "wheels.csv") << "t_us,speed_mps\n1790000123500001,2.5\n";
  const auto table = [&](const std::string& name) {
    return " --" + name + " " + (fixture.directory / (name + ".csv")).string();
  };
  CHECK(fixture.import(table("wheels")).status == 0);
  CHECK(logged(fixture.log, "RAW_WHEELS").size() == 1);
  CHECK(logged(fixture.log, "RAW_IMU").size() == recording.imu.size());
  CHECK(fixture.import(table("imu")).status == 0);
  const auto imu = logged(fixture.log, "RAW_IMU");
  REQUIRE(imu.size() == 1);
  CHECK(wire::decode_message<model::ImuSample>(imu[0]).value().angular_rate_rad_s.z() == 0.25);
}

TEST_CASE("damaged captures end in a log or in a line that names the file", "[cli][packets]") {
  CaptureFixture fixture;
  for (const MadeUpSensor& sensor : one_of_each_family()) {
    CAPTURE(sensor.name);
    fixture.write(sensor);
    const std::string more = fixture.describe(sensor);
    const Bytes whole = read_bytes(fixture.capture);
    for (int trial = 0; trial < 50; ++trial) {
      Bytes damaged = whole;
      if (trial % 3 == 0) damaged.resize(fixture.random() % whole.size());
      const auto changes = fixture.random() % 3000;
      for (std::size_t k = 0; k < changes && !damaged.empty(); ++k)
        damaged[fixture.random() % damaged.size()] = static_cast<std::uint8_t>(fixture.random());
      write_bytes(fixture.capture, damaged);
      std::filesystem::remove(fixture.log);
      const Outcome outcome = fixture.import(more);
      CAPTURE(outcome.error);
      REQUIRE((outcome.status == 0 || outcome.status == 1));
      REQUIRE(std::filesystem::exists(fixture.log) == (outcome.status == 0));
      if (outcome.status == 1) REQUIRE_THAT(outcome.error, Contains("drive.pcap"));
    }
  }
}
