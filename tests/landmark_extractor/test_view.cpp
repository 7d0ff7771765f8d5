// How far a sweep saw: what is hidden, what is in clear view, and never a standing tree for gone.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/bus/memory_bus.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_space.hpp"
#include "tests/landmark_extractor/simulated_sweep.hpp"

using namespace understory;
using namespace understory::landmark_extractor;

namespace {

/// A wood within walls 45 m away, and a lorry that hides a part of it.
test::Space wood_with_lorry(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-22.0, 22.0);
  std::uniform_real_distribution<double> radii(0.1, 0.3);
  test::Space space;
  space.slope = {0.002 * place(random), 0.002 * place(random)};
  space.facades = {{{45, -45}, {45, 45}, 12.0},
                   {{45, 45}, {-45, 45}, 12.0},
                   {{-45, 45}, {-45, -45}, 12.0},
                   {{-45, -45}, {45, -45}, 12.0},
                   {{-5.0, 3.0}, {5.0, 3.0}, 3.5}};
  while (space.stems.size() < 40) {
    const Eigen::Vector2d at(place(random), place(random));
    if (at.norm() > 4.0) space.stems.push_back({at, radii(random)});
  }
  return space;
}

/// Nearest to a tree's place that a line of sight from the origin to it meets [m]; 0 = the tree.
double first_in_front(const test::Space& space, const test::Stem& tree, double sensor_m) {
  const Eigen::Vector3d origin(0.0, 0.0, sensor_m);
  const Eigen::Vector3d to(tree.breast.x(), tree.breast.y(), 0.0);
  const Eigen::Vector3d ray = to.normalized();
  double range_m = to.norm();
  for (const test::Stem& stem : space.stems)
    if (&stem != &tree) range_m = std::min(range_m, test::hit(stem, space, origin, ray));
  for (const test::Facade& wall : space.facades)
    range_m = std::min(range_m, test::hit(wall, space, origin, ray));
  return range_m;
}

struct Counts {
  int hidden = 0, hidden_blocked = 0;
  int felled = 0, felled_clear = 0;
};

/// A de-skewed scan in one plane, in half a turn from the vehicle's right to its left or back while
/// it drives; sensor and vehicle are one.
model::PointSweep ring_while_driving(const std::vector<test::Circle>& trunks,
                                     const std::vector<test::Wall>& walls, bool is_leftward,
                                     const Eigen::Vector2d& velocity_mps, std::mt19937_64& random) {
  constexpr double kBeamTime_s = 1.4e-4;
  constexpr int kBeams = 361;
  std::normal_distribution<double> noise(0.0, 0.01);
  model::PointSweep ring;
  ring.rings = 1;
  ring.max_range_m = 80.0;
  ring.is_deskewed = true;
  for (int k = 0; k < kBeams; ++k) {
    const double time_s = kBeamTime_s * (k + 1 - kBeams);
    const Eigen::Vector2d from = time_s * velocity_mps;
    const double bearing = (is_leftward ? 1.0 : -1.0) * (k - 180) * std::numbers::pi / 360.0;
    const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
    double range_m = 100.0;
    for (const test::Circle& trunk : trunks)
      range_m = std::min(range_m, test::hit({trunk.centre - from, trunk.radius}, direction));
    for (const test::Wall& wall : walls)
      range_m = std::min(range_m, test::hit({wall.from - from, wall.to - from}, direction));
    if (range_m >= ring.max_range_m) continue;
    const Eigen::Vector2d at = from + (range_m + noise(random)) * direction;
    model::SweepPoint point;
    point.x_m = static_cast<float>(at.x());
    point.y_m = static_cast<float>(at.y());
    point.time_s = static_cast<float>(time_s);
    ring.points.push_back(point);
  }
  return ring;
}

void look_at_wood(int rings, std::uint64_t seed, Counts& counts) {
  std::mt19937_64 random(seed);
  const test::Spinner spinner = test::spinner_of(rings);
  const test::Space wood = wood_with_lorry(random);
  // Every third tree is felled.
  test::Space later = wood;
  later.stems.clear();
  for (std::size_t i = 0; i < wood.stems.size(); ++i)
    if (i % 3 != 0) later.stems.push_back(wood.stems[i]);
  LandmarkExtractor extractor;
  extractor.extract(test::sweep(later, spinner, random));
  const model::ViewRanges& view = extractor.view();
  REQUIRE(view.free.size() == 720);

  for (std::size_t i = 0; i < wood.stems.size(); ++i) {
    const test::Stem& tree = wood.stems[i];
    const model::LineOfSight sight = line_of_sight(view, tree.breast, tree.radius);
    const double distance_m = tree.breast.norm();
    const double first_m = first_in_front(later, tree, spinner.sensor.z());
    CAPTURE(rings, seed, i, distance_m, first_m);
    if (i % 3 != 0) CHECK(sight != model::LineOfSight::kClear);
    if (sight == model::LineOfSight::kClear) CHECK(first_m > distance_m - 0.01);
    const bool is_behind_lorry = tree.breast.y() > 5.0 && std::abs(tree.breast.x()) < 4.0;
    counts.hidden += is_behind_lorry ? 1 : 0;
    counts.hidden_blocked += is_behind_lorry && sight == model::LineOfSight::kBlocked ? 1 : 0;
    const bool is_felled = i % 3 == 0 && first_m >= distance_m - 0.01;
    counts.felled += is_felled ? 1 : 0;
    counts.felled_clear += is_felled && sight == model::LineOfSight::kClear ? 1 : 0;
  }
}

}  // namespace

TEST_CASE("what a lorry hides is told from what is gone", "[extractor]") {
  for (const int rings : {16, 32, 64}) {
    Counts counts;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) look_at_wood(rings, seed, counts);
    CAPTURE(rings, counts.hidden, counts.hidden_blocked, counts.felled, counts.felled_clear);
    CHECK(counts.hidden >= 8);
    CHECK(counts.hidden_blocked >= 0.9 * counts.hidden);
    CHECK(counts.felled >= 20);
    CHECK(counts.felled_clear >= 0.5 * counts.felled);
  }
}

TEST_CASE("a tilted vehicle sees as far as a level one", "[extractor]") {
  std::mt19937_64 random(9);
  const test::Space wood = wood_with_lorry(random);
  LandmarkExtractor extractor;
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-0.04, Eigen::Vector3d::UnitX()));
  std::array<int, 2> blocked{};
  for (const bool is_tilted : {false, true}) {
    extractor.extract(test::sweep(wood, test::spinner_of(32), random,
                                  is_tilted ? tilt : Eigen::Quaterniond::Identity()));
    for (double x = -3.0; x <= 3.0; x += 0.5)
      blocked[is_tilted ? 1 : 0] +=
          line_of_sight(extractor.view(), {x, 9.0}, 0.2) == model::LineOfSight::kBlocked ? 1 : 0;
    for (const test::Stem& stem : wood.stems)
      CHECK(line_of_sight(extractor.view(), stem.breast, stem.radius) !=
            model::LineOfSight::kClear);
  }
  CHECK(blocked[0] >= 12);
  CHECK(blocked[1] >= 12);
}

TEST_CASE("a laser that scans one plane says how far it saw; what is malformed says nothing",
          "[extractor]") {
  std::mt19937_64 random(3);
  const std::vector<test::Circle> trunks{test::circle_at(10.0, 0.2, 0.2)};
  const std::vector<test::Wall> walls{{{30.0, -60.0}, {30.0, 60.0}}};
  LandmarkExtractor extractor;
  extractor.extract(test::sweep(trunks, walls, 0.02, random));
  const auto at = [&](double range_m, double bearing) {
    const Eigen::Vector2d direction(std::cos(bearing), std::sin(bearing));
    return line_of_sight(extractor.view(), range_m * direction, 0.2);
  };
  CHECK(at(10.0, -0.2) == model::LineOfSight::kClear);
  CHECK(at(10.0, 0.2) != model::LineOfSight::kClear);  // It stands there.
  CHECK(at(40.0, -0.2) == model::LineOfSight::kBlocked);
  CHECK(at(10.0, 3.0) == model::LineOfSight::kUnknown);  // Behind the vehicle.

  extractor.extract(model::PlanarScan{});
  CHECK(extractor.view().free.empty());
  extractor.extract(model::PointSweep{});
  CHECK(extractor.view().free.empty());
  CHECK(at(10.0, -0.2) == model::LineOfSight::kUnknown);
}

TEST_CASE("a laser whose beams come one after another says how far it saw while it drives",
          "[extractor]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> across(-12.0, 12.0);
  // A wall of stacked timber at one side, a front ahead; what is farther to the left gives nothing.
  const std::vector<test::Wall> walls{{{6.0, -9.0}, {11.0, -3.0}}, {{25.0, -30.0}, {25.0, 6.0}}};
  int gone = 0, clear = 0, behind = 0, blocked = 0;
  for (int run = 0; run < 80; ++run) {
    const bool is_leftward = run % 2 == 0;
    // Half a metre to a metre during the scan: more than a trunk is wide.
    const Eigen::Vector2d velocity_mps(10.0 + 0.125 * run, run % 4 < 2 ? 2.0 : -2.0);
    std::vector<test::Circle> trunks;
    while (trunks.size() < 10) {
      const Eigen::Vector2d at(9.0 + 0.5 * across(random), across(random));
      if (at.norm() > 3.0) trunks.push_back({at, 0.15});
    }
    const std::vector<test::Circle> left(trunks.begin() + 5, trunks.end());
    LandmarkExtractor extractor;
    extractor.extract(ring_while_driving(left, walls, is_leftward, velocity_mps, random));
    const model::ViewRanges& view = extractor.view();
    REQUIRE(view.free.size() > 100);
    REQUIRE(std::abs(view.step_rad) * static_cast<double>(view.free.size()) < 3.2);

    for (std::size_t i = 0; i < trunks.size(); ++i) {
      const model::LineOfSight sight = line_of_sight(view, trunks[i].centre, 0.15);
      CAPTURE(run, i, trunks[i].centre.transpose());
      if (i >= 5) CHECK(sight != model::LineOfSight::kClear);
      const double bearing = std::atan2(trunks[i].centre.y(), trunks[i].centre.x());
      const bool has_front_behind = bearing > -0.22 && bearing < 0.2;
      const bool is_alone = std::ranges::none_of(left, [&](const test::Circle& other) {
        return std::abs(std::remainder(std::atan2(other.centre.y(), other.centre.x()) - bearing,
                                       2.0 * std::numbers::pi)) < 0.12;
      });
      gone += i < 5 && has_front_behind && is_alone ? 1 : 0;
      clear += i < 5 && has_front_behind && is_alone && sight == model::LineOfSight::kClear ? 1 : 0;
    }
    for (const double further : {1.5, 4.0}) {
      const Eigen::Vector2d at = (1.0 + further / 10.5) * Eigen::Vector2d(8.5, -6.0);
      ++behind;
      blocked += line_of_sight(view, at, 0.15) == model::LineOfSight::kBlocked ? 1 : 0;
    }
    // Where no beam came back nothing is known, nor behind the vehicle.
    CHECK(line_of_sight(view, {-8.0, 1.0}, 0.15) == model::LineOfSight::kUnknown);
  }
  CAPTURE(gone, clear, behind, blocked);
  CHECK(gone >= 15);
  CHECK(clear >= 0.9 * gone);
  CHECK(blocked >= 0.95 * behind);
}

TEST_CASE("ranges and cloud go out before the landmarks of the same sweep", "[extractor]") {
  bus::MemoryBus bus(bus::MemoryBus::Queues::kUnlimited);
  bus::HostedService hosted(landmark_extractor_service(), bus, bus::no_clock(),
                            "[place_scan]\nperiod_s = 1.0\n", "test.toml");
  std::vector<std::string> channels;
  model::Utime utime = 0;
  bus.subscribe("LANDMARKS", 0,
                [&](const bus::BusMessage& /*message*/) { channels.emplace_back("LANDMARKS"); });
  bus.subscribe("VIEW_RANGES", 0, [&](const bus::BusMessage& message) {
    channels.emplace_back("VIEW_RANGES");
    const auto view = wire::decode_message<model::ViewRanges>(message.bytes);
    REQUIRE(view);
    utime = view->utime;
  });
  bus.subscribe("PLACE_SCAN", 0, [&](const bus::BusMessage& message) {
    channels.emplace_back("PLACE_SCAN");
    const auto cloud = wire::decode_message<model::PlaceScan>(message.bytes);
    REQUIRE(cloud);
    CHECK(cloud->utime == 5'000'000);
    CHECK_FALSE(cloud->points.empty());
  });
  hosted.node().connect();
  std::mt19937_64 random(4);
  model::PlanarScan scan = test::sweep({test::circle_at(10.0, 0.2, 0.2)}, {}, 0.02, random);
  scan.utime = 5'000'000;
  bus.publish("LIDAR_SCAN", wire::encode_message(scan));
  bus.drain();
  const std::vector<std::string> all{"PLACE_SCAN", "VIEW_RANGES", "LANDMARKS"};
  CHECK(channels == all);
  CHECK(utime == scan.utime);

  // The next cloud is not due.
  scan.utime += 200'000;
  bus.publish("LIDAR_SCAN", wire::encode_message(scan));
  bus.drain();
  CHECK(channels.size() == 5);
}
