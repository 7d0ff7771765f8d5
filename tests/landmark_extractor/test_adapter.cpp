// The extractor as a service on a bus: sweeps in, landmarks out, bad sweeps counted.
#include "common/bus/memory_bus.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_space.hpp"
#include "tests/landmark_extractor/simulated_sweep.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::test;

namespace {

/// The service on a bus, with everything that it publishes.
struct Bench {
  explicit Bench(const std::string& toml = "", const LandmarkExtractorChannels& channels = {})
      : bus(bus::MemoryBus::Queues::kUnlimited),
        hosted(landmark_extractor_service(channels), bus, bus::no_clock(), toml, "test.toml") {
    bus.subscribe(channels.landmarks, 0, [this](const bus::BusMessage& message) {
      const auto scan = wire::decode_message<model::LandmarkScan>(message.bytes);
      REQUIRE(scan);
      landmarks.push_back(*scan);
    });
    hosted.node().connect();
  }
  void send(const model::PlanarScan& scan) { send(wire::encode_message(scan)); }
  void send(const std::vector<std::uint8_t>& bytes, const std::string& channel = "LIDAR_SCAN") {
    bus.publish(channel, bytes);
    bus.drain();
  }
  std::int64_t count(wire::Reason reason) {
    return hosted.node().monitor().count_of("LIDAR_SCAN", reason);
  }

  bus::MemoryBus bus;
  bus::HostedService hosted;
  std::vector<model::LandmarkScan> landmarks;
};

/// The k-th sweep of a laser among ten trunks.
model::PlanarScan numbered_sweep(std::uint64_t k, std::mt19937_64& random) {
  std::uniform_real_distribution<double> ranges(3.0, 25.0);
  std::vector<test::Circle> trunks;
  for (int i = 0; i < 10; ++i)
    trunks.push_back(test::circle_at(ranges(random), -1.35 + 0.3 * i, 0.15));
  model::PlanarScan scan = sweep(trunks, {}, 0.02, random);
  scan.utime = 1000000 + 200000 * static_cast<model::Utime>(k);
  scan.sequence = k;
  return scan;
}

}  // namespace

TEST_CASE("on the bus the extractor publishes what the stage gives", "[extractor]") {
  std::mt19937_64 random(1);
  Bench bench;
  LandmarkExtractor stage;
  for (std::uint64_t k = 0; k < 20; ++k) {
    const model::PlanarScan scan = numbered_sweep(k, random);
    const model::LandmarkScan expected = stage.extract(scan);
    CHECK(expected.detections.size() >= 5);
    bench.send(scan);
    REQUIRE(bench.landmarks.size() == k + 1);
    const model::LandmarkScan& published = bench.landmarks.back();
    CHECK(published.utime == scan.utime);
    CHECK(published.sequence == k);
    // The wire's covariances are symmetric to the last bit.
    const auto on_wire = wire::decode_message<model::LandmarkScan>(wire::encode_message(expected));
    REQUIRE(on_wire);
    const bool is_the_same = wire::encode_message(published) == wire::encode_message(*on_wire);
    CHECK(is_the_same);
  }
}

TEST_CASE("sweeps that cannot be are counted and give nothing", "[extractor]") {
  std::mt19937_64 random(2);
  Bench bench;
  for (std::uint64_t k = 0; k < 10; ++k) {
    const model::PlanarScan scan = numbered_sweep(k, random);
    model::PlanarScan bad = scan;
    bad.bearing_step_rad = std::numeric_limits<double>::quiet_NaN();
    bench.send(bad);
    std::vector<std::uint8_t> cut = wire::encode_message(scan);
    cut.resize(cut.size() / 2);
    bench.send(cut);
    bench.send(scan);
    bench.send(scan);
  }
  CHECK(bench.landmarks.size() == 10);
  CHECK(bench.count(wire::Reason::kNotFinite) == 10);
  CHECK(bench.count(wire::Reason::kBadCount) == 10);
  CHECK(bench.count(wire::Reason::kDuplicate) == 10);
}

TEST_CASE("the extractor's parameters and channels are those it was given", "[extractor]") {
  std::mt19937_64 random(3);
  const model::PlanarScan scan = numbered_sweep(0, random);
  LandmarkExtractorChannels front;
  front.all.rename(front.lidar_scan, "FRONT");
  front.all.rename(front.landmarks, "FRONT_MARKS");
  Bench near("[planar]\nmax_range_m = 5\n", front);
  near.send(scan);
  CHECK(near.landmarks.empty());
  near.send(wire::encode_message(scan), "FRONT");
  REQUIRE(near.landmarks.size() == 1);
  CHECK(near.landmarks[0].field_of_view.max_range_m == 5.0);
  for (const auto& detection : near.landmarks[0].detections) {
    CHECK(detection.position_m.norm() < 5.0);
  }
}

TEST_CASE("sweeps in parts become one scan; lost parts and bad sweeps are counted", "[extractor]") {
  std::mt19937_64 random(4);
  Bench bench;
  test::Space space;
  space.stems = {{{6.0, 2.0}, 0.2}, {{-4.0, 5.0}, 0.15}, {{1.0, -9.0}, 0.1}};
  const auto count = [&](wire::Reason reason) {
    return bench.hosted.node().monitor().count_of("LIDAR_SWEEP", reason);
  };
  std::uint64_t sequence = 0;
  for (std::uint64_t turn = 0; turn < 6; ++turn) {
    model::PointSweep whole = sweep(space, test::spinner_of(16), random);
    whole.utime = 1000000 + 100000 * static_cast<model::Utime>(turn);
    whole.revolution = turn;
    if (turn == 4) whole.is_deskewed = false;
    if (turn == 5) whole.attitude.reset();
    std::vector<model::PointSweep> parts = split_sweep(whole, 4000);
    REQUIRE(parts.size() > 2);
    for (model::PointSweep& part : parts) {
      part.sequence = sequence++;
      if (turn == 2 && part.part == 1) continue;  // Lost on the way.
      bench.send(wire::encode_message(part), "LIDAR_SWEEP");
    }
  }
  // The turn with a lost part and the one that is not in frame vehicle are missing.
  REQUIRE(bench.landmarks.size() == 4);
  for (const model::LandmarkScan& scan : bench.landmarks) CHECK(scan.detections.size() == 3);
  CHECK(count(wire::Reason::kPartsMissing) >= 1);
  CHECK(count(wire::Reason::kInconsistent) == 1);
  CHECK(count(wire::Reason::kNotCalibrated) == 1);
}
