#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <optional>

#include "common/bus/live_bus.hpp"
#include "common/wire/convert.hpp"
#include "deploy/launch/child_process.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/truth_landmarks_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

model::Utime clock_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

/// Listens to the drives of `understory sim` on a bus of its own.
class LiveDrives {
 public:
  LiveDrives() : bus_(bus::make_live_bus(url_)) {
    take<ground_truth_t>("GROUND_TRUTH");
    take<truth_landmarks_t>("TRUTH_LANDMARKS");
    take<model::LandmarkScan>("LANDMARKS");
    take<model::ImuSample>("RAW_IMU");
    take<model::WheelSample>("RAW_WHEELS");
    take<model::GnssFix>("RAW_GNSS");
    take<model::PointSweep>("RAW_SWEEP");
    take<model::PlanarScan>("RAW_SCAN");
    bus_->subscribe("ODOMETRY", 0, [this](const bus::BusMessage& message) {
      const auto odometry = wire::decode_message<model::Odometry>(message.bytes);
      if (!odometry) return;
      stamps["ODOMETRY"].push_back(odometry->utime);
      stamps["from_utime"].push_back(odometry->from_utime);
    });
  }

  /// One drive from its first message to its last.
  bool drive(std::vector<std::string> arguments) {
    stamps.clear();
    arguments.insert(arguments.begin(), "sim");
    arguments.insert(arguments.end(), {"--lcm-url", url_});
    const auto simulator =
        launch::ChildProcess::start({UNDERSTORY_COMMAND, std::move(arguments), {}});
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::optional<launch::Ending> ending;
    while (!ending && std::chrono::steady_clock::now() < end) {
      ending = simulator.ended();
      while (bus_->handle_one(20)) {
      }
    }
    return ending && ending->exit_code == 0 && ending->signal == 0;
  }

  std::map<std::string, std::vector<model::Utime>> stamps;  ///< By channel.

 private:
  template <class Message>
  void take(const std::string& channel) {
    bus_->subscribe(channel, 0, [this, channel](const bus::BusMessage& message) {
      const auto value = wire::decode_message<Message>(message.bytes);
      if (value) stamps[channel].push_back(value->utime);
    });
  }

  std::string url_ =
      "udpm://239.255.76.70:" + std::to_string(21000 + ::getpid() % 20000) + "?ttl=0";
  std::unique_ptr<bus::Bus> bus_;
};

}  // namespace

TEST_CASE("sim with sensors writes every raw channel, sweeps in parts that fit together", "[cli]") {
  const test::TemporaryDirectory directory;
  const auto log = directory / "drive.lcm";
  const auto outcome = understory_command(
      directory,
      "sim countryside --distance 20 --standstill 1 --lidar vlp16 --planar-laser --out " +
          log.string());
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("m driven in"));

  std::map<std::string, int> events;
  model::SweepAssembler assembler;
  int sweeps = 0;
  std::int64_t last_received = 0;
  model::Utime last_truth = -1;
  io::LcmLogReader reader(log);
  while (const auto event = reader.next()) {
    ++events[event->channel];
    CHECK(event->utime >= last_received);
    last_received = event->utime;
    if (event->channel == "RAW_SWEEP") {
      CHECK(event->data.size() < 65000);
      auto part = wire::decode_message<model::PointSweep>(event->data);
      REQUIRE(part);
      if (const auto sweep = assembler.add(std::move(*part))) {
        ++sweeps;
        CHECK(sweep->rings == 16);
        CHECK(sweep->points.size() > 5000);
        CHECK(sweep->utime <= event->utime);
      }
    } else if (event->channel == "RAW_IMU") {
      CHECK(wire::decode_message<model::ImuSample>(event->data));
    } else if (event->channel == "GROUND_TRUTH") {
      const auto truth = wire::decode_message<ground_truth_t>(event->data);
      REQUIRE(truth);
      CHECK(truth->utime > last_truth);
      last_truth = truth->utime;
    } else if (event->channel == "TRUTH_LANDMARKS") {
      const auto landmarks = wire::decode_message<truth_landmarks_t>(event->data);
      REQUIRE(landmarks);
      CHECK(landmarks->num_landmarks > 0);
    }
  }
  const double seconds = 1e-6 * static_cast<double>(last_received);
  CHECK(seconds > 5.0);
  CHECK(assembler.incomplete_revolutions() == 0);
  CHECK(sweeps == Approx(10.0 * seconds).margin(1.0));
  CHECK(events["RAW_IMU"] == Approx(200.0 * seconds).margin(2.0));
  CHECK(events["RAW_WHEELS"] == Approx(100.0 * seconds).margin(2.0));
  CHECK(events["RAW_SCAN"] == Approx(10.0 * seconds).margin(2.0));
  CHECK(events["RAW_GNSS"] == Approx(2.0 * seconds).margin(2.0));
  CHECK(events["GROUND_TRUTH"] == Approx(50.0 * seconds).margin(2.0));
  CHECK(events["TRUTH_LANDMARKS"] == 1);
}

TEST_CASE("sim with few trunks ahead, wheels and shared errors writes what it is told", "[cli]") {
  const test::TemporaryDirectory directory;
  const auto log = directory / "few.lcm";
  const std::string few =
      "sim sparse --path line --length 60 --interval 1 --sensor-range 20 --view-deg 180 "
      "--trunks-in-view 2.5 --noise 0 --detection 1 --wheels --out " +
      log.string();
  const auto places = [&](const std::string& more) {
    const auto outcome = understory_command(directory, few + more);
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
    std::vector<Eigen::Vector3d> result;
    int motions = 0;
    io::LcmLogReader reader(log);
    while (const auto event = reader.next()) {
      if (event->channel == "ODOMETRY") ++motions;
      if (event->channel != "LANDMARKS") continue;
      const auto scan = wire::decode_message<model::LandmarkScan>(event->data);
      REQUIRE(scan);
      CHECK(scan->field_of_view.width_rad == Approx(3.14159265));
      for (const model::Detection& one : scan->detections) {
        CHECK(one.position_m.x() > -0.5);
        result.push_back(one.position_m);
      }
    }
    CHECK(motions == 59);
    return result;
  };

  const auto exact = places("");
  CHECK(exact.size() / 60 >= 1);
  CHECK(exact.size() / 60 <= 4);
  CHECK(places("") == exact);
  CHECK(places(" --direction-noise 0.02") != exact);
  CHECK(places(" --along-noise 0.02") != exact);
  CHECK(places(" --radial-bias -0.01") != exact);
  CHECK(places(" --bearing-bias 0.01") != exact);
  CHECK(places(" --level-noise 0.01") != exact);
  CHECK(places(" --missed 0.5").size() < exact.size());
}

TEST_CASE("sim names an unknown value", "[cli]") {
  const test::TemporaryDirectory directory;
  const auto run = [&](const std::string& arguments) {
    return understory_command(directory,
                              "sim " + arguments + " --out " + (directory / "never.lcm").string());
  };

  const auto lidar = run("urban --lidar vlp17");
  CHECK(lidar.status == 2);
  CHECK_THAT(lidar.error, Contains("vlp17"));
  CHECK(run("forest3d --forest jungle").status == 2);
  CHECK(run("poles:a.csv").status == 2);
  const auto missing = run("poles:" + (directory / "none.csv").string() + ",b.csv");
  CHECK(missing.status == 1);
  CHECK_THAT(missing.error, Contains("none.csv"));

  const auto renamed = run("countryside --way 20");
  CHECK(renamed.status == 2);
  CHECK_THAT(renamed.error, Contains("--way is now called --distance"));
  CHECK_FALSE(std::filesystem::exists(directory / "never.lcm"));
}

TEST_CASE("sim takes every number within its limits and none beyond", "[cli]") {
  struct Limits {
    std::string option;
    double least, most;
  };
  const std::vector<Limits> all{{"--length", 1.0, 1e6},          {"--interval", 1e-3, 100.0},
                                {"--speed", 1e-3, 100.0},        {"--sensor-range", 1.0, 1e3},
                                {"--detection", 0.0, 1.0},       {"--noise", 0.0, 10.0},
                                {"--distance", 20.0, 2e5},       {"--laps", 1, 1000},
                                {"--cruise", 0.5, 30.0},         {"--standstill", 0.0, 3600},
                                {"--gnss-until", 0.0, 1e6},      {"--rate", 1e-3, 1e3},
                                {"--view-deg", 1.0, 360.0},      {"--trunks-in-view", 0.0, 1e4},
                                {"--along-noise", 0.0, 5.0},     {"--along-length", 1e-3, 1e5},
                                {"--direction-noise", 0.0, 5.0}, {"--direction-harmonics", 1, 100},
                                {"--level-noise", 0.0, 0.5},     {"--missed", 0.0, 1.0}};
  const test::TemporaryDirectory directory;
  // A world that is none: numbers are looked at first, and nothing is driven.
  const auto error_of = [&](const std::string& option, double value) {
    const auto outcome =
        understory_command(directory, fmt::format("sim no-such-world.csv {} {} --out {}", option,
                                                  value, (directory / "never.lcm").string()));
    CHECK(outcome.status != 0);
    return outcome.error;
  };
  for (const Limits& one : all) {
    for (const double within : {one.least, one.most})
      CHECK_THAT(error_of(one.option, within), Contains("no-such-world.csv"));
    for (const double beyond : {one.least - std::max(1.0, one.least), one.most + 1.0})
      CHECK_THAT(error_of(one.option, beyond), Contains(one.option));
  }
}

TEST_CASE("a live drive that is started again goes on in time", "[cli]") {
  LiveDrives live;
  model::Utime last = clock_now();
  for (int run = 0; run < 2; ++run) {
    REQUIRE(
        live.drive({"dense", "--length", "4", "--interval", "0.5", "--speed", "2", "--wheels"}));
    const auto& truth = live.stamps["GROUND_TRUTH"];
    REQUIRE(truth.size() >= 4);
    CHECK(truth.front() > last);
    CHECK(truth.back() <= clock_now());
    CHECK(live.stamps["LANDMARKS"] == truth);
    CHECK(live.stamps["TRUTH_LANDMARKS"] == std::vector<model::Utime>{truth.front()});

    // Motions reach from scan to scan.
    CHECK(live.stamps["from_utime"] == std::vector<model::Utime>(truth.begin(), truth.end() - 1));
    CHECK(live.stamps["ODOMETRY"] == std::vector<model::Utime>(truth.begin() + 1, truth.end()));
    last = truth.back();
  }
}

TEST_CASE("all sensors of a live drive are stamped by the computer's clock", "[cli]") {
  LiveDrives live;
  constexpr model::Utime kLongest_us = 60'000'000;
  const model::Utime before = clock_now();
  REQUIRE(live.drive({"countryside", "--distance", "20", "--standstill", "1", "--lidar", "vlp16",
                      "--planar-laser", "--rate", "4"}));
  REQUIRE(live.stamps["TRUTH_LANDMARKS"].size() == 1);
  const model::Utime start = live.stamps["TRUTH_LANDMARKS"].front();
  CHECK(start >= before);
  CHECK(start <= clock_now());
  const model::Utime end = live.stamps["GROUND_TRUTH"].back();
  CHECK(live.stamps["GROUND_TRUTH"].front() == start);
  CHECK(end - start < kLongest_us);

  for (const std::string channel : {"RAW_IMU", "RAW_WHEELS", "RAW_GNSS", "RAW_SWEEP", "RAW_SCAN"}) {
    CAPTURE(channel);
    REQUIRE(live.stamps[channel].size() > 2);
    CHECK(live.stamps[channel].front() - start >= 0);
    CHECK(live.stamps[channel].front() - start < 1'000'000);
    CHECK(live.stamps[channel].back() <= end + 20'000);  // A period of GROUND_TRUTH.
    CHECK(live.stamps[channel].back() > end - 1'000'000);
  }
}
