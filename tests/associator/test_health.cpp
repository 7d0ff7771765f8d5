// What HEALTH says of the associator, by faults of its input.
#include "services/associator/health_watch.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

const sim::TrunkField& health_trunks() {
  static const sim::TrunkField field = [] {
    sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
    forest.side_m = 300.0;
    return sim::make_trunk_field(forest, 3);
  }();
  return field;
}

/// An associator on a drive and what is shown of it.
struct WatchedAssociator {
  sim::InertialDrive drive;
  Associator associator{AssociatorParameters{}};
  HealthWatch watch;

  explicit WatchedAssociator(std::uint64_t seed) : drive({}, health_trunks(), seed) {}

  template <class Change>
  void go(Change change) {
    sim::DriveStep step = drive.next();
    change(step.scan);
    for (const model::Odometry& increment : step.odometry) associator.add(increment);
    const AssociatorCounters before = associator.counters();
    associator.add(step.scan);
    watch.add(step.scan, before, associator.counters());
  }
  bool is_lost() const { return watch.conditions()[0].condition.holds(); }
  bool is_refusing() const { return watch.conditions()[1].condition.holds(); }
};

}  // namespace

TEST_CASE("An associator with good scans is well", "[health]") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    WatchedAssociator watched(seed);
    for (int k = 0; k < 300; ++k) {
      watched.go([](model::LandmarkScan&) {});
      REQUIRE_FALSE(watched.is_lost());
      REQUIRE_FALSE(watched.is_refusing());
    }
  }
}

TEST_CASE("An associator whose detections are shuffled is lost, and well again later", "[health]") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> where(-20.0, 20.0);
  WatchedAssociator watched(4);
  for (int k = 0; k < 50; ++k) watched.go([](model::LandmarkScan&) {});
  for (int k = 0; k < 30; ++k) {
    watched.go([&](model::LandmarkScan& scan) {
      for (model::Detection& one : scan.detections) {
        one.position_m.head<2>() = Eigen::Vector2d(where(random), where(random));
      }
    });
  }
  CHECK(watched.is_lost());
  for (int k = 0; k < 60; ++k) watched.go([](model::LandmarkScan&) {});
  CHECK_FALSE(watched.is_lost());
}

TEST_CASE("An associator to which scans come late says so", "[health]") {
  WatchedAssociator watched(6);
  for (int k = 0; k < 20; ++k) {
    watched.go([&](model::LandmarkScan& scan) { scan.utime -= k < 5 ? 0 : 1'000'000; });
  }
  CHECK(watched.is_refusing());
}
