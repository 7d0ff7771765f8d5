// Loop closer and mapper on one bus: a drive whose drift is far beyond what odometry states.
#include <map>
#include <memory>

#include "common/bus/memory_bus.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/loop_closer/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/ring_drive.hpp"
#include "understory/health_t.hpp"

using namespace understory;
using test::RingDrive;
using test::RingOptions;

namespace {

constexpr const char* kMapperToml =
    "[smoothing]\nuse_odometry = true\nlost_sigma_m = 100.0\n"
    "lost_sigma_rad = 3.0\n";

/// Mapper, and the loop closer where it is wanted, on one bus.
class Stack {
 public:
  explicit Stack(bool has_closer, const std::string& closer_toml = "") {
    host(geoslam_mapper::geoslam_mapper_service(), kMapperToml);
    if (has_closer)
      host(loop_closer::loop_closer_service(), "[stems]\nuse_diameters = false\n" + closer_toml);
    bus_.subscribe("MAP", 0, [this](const bus::BusMessage& message) {
      map_ = wire::decode_message<model::WholeMap>(message.bytes).value();
    });
    bus_.subscribe("LOOP_CLOSURE", 0, [this](const bus::BusMessage& message) {
      bytes_.emplace_back(message.bytes.begin(), message.bytes.end());
      closures.push_back(wire::decode_message<model::LoopClosure>(message.bytes).value());
    });
    bus_.subscribe("LOOP_RESULT", 0, [this](const bus::BusMessage& message) {
      const auto one = wire::decode_message<model::LoopResult>(message.bytes).value();
      ++results[one.status];
    });
  }

  void drive(const RingDrive& drive, std::size_t first, std::size_t last, bool has_clouds = false) {
    for (std::size_t k = first; k < last; ++k) {
      if (has_clouds) publish("PLACE_SCAN", wire::encode_message(drive.cloud_at(k)));
      if (k > 0) publish("ODOMETRY", wire::encode_message(drive.odometry_to(k)));
      publish("KEYFRAME", wire::encode_message(drive.keyframe_at(k)));
    }
  }
  void publish(const std::string& channel, const wire::Bytes& bytes) {
    bus_.publish(channel, bytes);
    bus_.drain();
  }
  model::WholeMap finish() {
    for (auto& one : hosted_) one->adapter().finish();
    bus_.drain();
    return map_;
  }
  bus::HostedService& closer() { return *hosted_.back(); }
  const std::vector<wire::Bytes>& sent_bytes() const { return bytes_; }

  std::vector<model::LoopClosure> closures;
  std::map<model::LoopResult::Status, int> results;

 private:
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }

  bus::MemoryBus bus_;
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
  model::WholeMap map_;
  std::vector<wire::Bytes> bytes_;
};

/// Mean error of the keyframes in the map [m].
double error_m(const RingDrive& drive, const model::WholeMap& map) {
  REQUIRE_FALSE(map.keyframes.empty());
  double sum = 0.0;
  for (const model::KeyframePose& one : map.keyframes)
    sum +=
        (one.map_T_vehicle.translation() - drive.truth(one.keyframe_sequence).translation()).norm();
  return sum / static_cast<double>(map.keyframes.size());
}

RingOptions drifting(std::uint64_t seed) {
  RingOptions options;
  options.seed = seed;
  options.yaw_bias_rad = 5e-3;
  options.laps = 1.3;
  return options;
}

}  // namespace

TEST_CASE("A loop that the mapper cannot see by itself is closed", "[loop_closer][service]") {
  for (const std::uint64_t seed : {31, 32}) {
    const RingDrive drive(drifting(seed));
    Stack alone(false);
    alone.drive(drive, 0, drive.size());
    const double without_m = error_m(drive, alone.finish());
    CHECK(alone.closures.empty());

    Stack both(true);
    both.drive(drive, 0, drive.size());
    const double with_m = error_m(drive, both.finish());
    CAPTURE(seed, without_m, with_m, both.closures.size());
    CHECK(both.results[model::LoopResult::Status::kAccepted] >= 1);
    CHECK(both.results[model::LoopResult::Status::kRefused] == 0);
    CHECK(without_m > 3.0);
    CHECK(with_m < 0.3 * without_m);
  }
}

TEST_CASE("Clouds from the bus close the loop as well", "[loop_closer][service][clouds]") {
  const RingDrive drive(drifting(31));
  Stack both(true, "[search]\ndetector = \"scan_context\"\nverifier = \"generalised_icp\"\n");
  both.drive(drive, 0, drive.size(), true);
  const double with_m = error_m(drive, both.finish());
  REQUIRE_FALSE(both.closures.empty());
  CHECK(both.closures.front().source == "scan_context, generalised_icp");
  CHECK(both.results[model::LoopResult::Status::kAccepted] >= 1);
  CHECK(both.results[model::LoopResult::Status::kRefused] == 0);
  CHECK(with_m < 1.0);
}
