// What HEALTH says of the filter, by faults of its input.
#include <random>

#include "common/wire/convert.hpp"
#include "services/ekf/health_watch.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// A filter on a drive and what is shown of it.
struct WatchedFilter {
  sim::InertialDrive drive;
  Ekf filter{white_noise()};
  HealthWatch watch;

  explicit WatchedFilter(std::uint64_t seed) : drive(short_drive(), trunks(), seed) {}

  template <class Message>
  void add(const Message& message) {
    const EkfCounters before = filter.counters();
    const EkfOutput output = filter.add(message);
    watch.add(output, before, filter.counters());
  }
  template <class Change>
  void go(int scans, Change change) {
    for (int k = 0; k < scans; ++k) {
      const sim::DriveStep step = drive.next();
      model::TrackedScan scan = true_tracks(step);
      std::vector<model::Odometry> odometry = step.odometry;
      change(scan, odometry);
      for (const model::Odometry& increment : odometry) add(increment);
      add(scan);
    }
  }
  void go(int scans) {
    go(scans, [](model::TrackedScan&, std::vector<model::Odometry>&) {});
  }
  bool shows(wire::Reason reason) const {
    return std::ranges::any_of(watch.conditions(), [&](const bus::WatchedCondition& one) {
      return one.reason == reason && one.condition.holds();
    });
  }
  bool is_well() const {
    return std::ranges::none_of(
        watch.conditions(), [](const bus::WatchedCondition& one) { return one.condition.holds(); });
  }
};

}  // namespace

TEST_CASE("A filter with good input is well", "[health]") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    WatchedFilter watched(seed);
    for (int k = 0; k < 300; ++k) {
      watched.go(1);
      REQUIRE(watched.is_well());
    }
  }
}

TEST_CASE("A filter whose detections are noisier than stated says that it diverged", "[health]") {
  WatchedFilter watched(11);
  watched.go(100);
  watched.go(100, [](model::TrackedScan& scan, std::vector<model::Odometry>&) {
    for (model::TrackedLandmark& one : scan.landmarks) one.observed.covariance_m2 /= 6.0;
  });
  CHECK(watched.shows(wire::Reason::kDiverged));
  watched.go(200);
  CHECK_FALSE(watched.shows(wire::Reason::kDiverged));
}

TEST_CASE("A filter that can use no landmark is lost", "[health]") {
  WatchedFilter watched(12);
  watched.go(100);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> where(-15.0, 15.0);
  model::TrackId fresh = 1'000'000'000;
  watched.go(15, [&](model::TrackedScan& scan, std::vector<model::Odometry>&) {
    for (model::TrackedLandmark& one : scan.landmarks) {
      one.observed.position_m.head<2>() = Eigen::Vector2d(where(random), where(random));
      one.track_id = ++fresh;  // Nobody knows it.
    }
  });
  CHECK(watched.shows(wire::Reason::kLost));
  watched.go(100);
  CHECK_FALSE(watched.shows(wire::Reason::kLost));
}

TEST_CASE("A filter that is less certain of its place than the limit is lost", "[health]") {
  EkfOutput output;
  output.scan.emplace();
  output.pose.emplace();
  HealthWatch watch;
  const HealthParameters parameters;
  output.pose->covariance =
      Eigen::Vector3d(1.0, 2.0 * std::pow(parameters.lost_sigma_m, 2), 1e-4).asDiagonal();
  for (int k = 0; k < parameters.lost.raise_at; ++k) watch.add(output, {}, {});
  CHECK(watch.conditions()[0].condition.holds());
}

TEST_CASE("A restart of the filter is shown for some seconds", "[health]") {
  WatchedFilter watched(13);
  watched.go(50);
  for (int k = 0; k < 200; ++k) watched.drive.next();  // 20 s without odometry and scans.
  watched.go(20);
  CHECK(watched.filter.counters().restarts == 1);
  CHECK(watched.shows(wire::Reason::kRestarted));
  watched.go(60);
  CHECK_FALSE(watched.shows(wire::Reason::kRestarted));
}

TEST_CASE("A filter to which odometry comes late says so", "[health]") {
  WatchedFilter watched(14);
  watched.go(20);
  watched.go(40, [](model::TrackedScan&, std::vector<model::Odometry>& odometry) {
    for (model::Odometry& increment : odometry) {
      increment.from_utime -= 1'000'000;
      increment.utime -= 1'000'000;
    }
  });
  CHECK(watched.shows(wire::Reason::kInputRefused));
}

TEST_CASE("After a pause of all sensors the filter is well again, however long it was", "[ekf]") {
  for (const double pause_s : {12.0, 60.0, 3600.0, 86400.0}) {
    CAPTURE(pause_s);
    WatchedFilter run(3);
    run.go(100);
    REQUIRE(run.is_well());

    const auto shift_us = static_cast<model::Utime>(1e6 * pause_s);
    const auto later = [&](model::TrackedScan& scan, std::vector<model::Odometry>& odometry) {
      scan.utime += shift_us;
      for (model::Odometry& increment : odometry) {
        increment.from_utime += shift_us;
        increment.utime += shift_us;
      }
    };
    run.go(20, later);
    CHECK(run.shows(wire::Reason::kRestarted));
    run.go(150, later);
    CHECK(run.is_well());
    CHECK(run.filter.counters().restarts == 1);

    // What it publishes is taken by others.
    const sim::DriveStep step = run.drive.next();
    model::TrackedScan scan = true_tracks(step);
    scan.utime += shift_us;
    for (model::Odometry increment : step.odometry) {
      increment.from_utime += shift_us;
      increment.utime += shift_us;
      run.filter.add(increment);
    }
    const EkfOutput output = run.filter.add(scan);
    REQUIRE(output.pose);
    CHECK(wire::decode_message<model::EkfPose>(wire::encode_message(*output.pose)));
    CHECK(wire::decode_message<model::EkfMap>(wire::encode_message(*output.map)));
  }
}
