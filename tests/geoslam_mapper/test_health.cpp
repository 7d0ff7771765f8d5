// What HEALTH says of the mapper, by faults of its input.
#include "services/geoslam_mapper/health_watch.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;

namespace {

std::vector<model::Keyframe> keyframes_of(std::uint64_t seed, double length_m) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.length_m = length_m;
  const sim::Drive drive(parameters, seed);
  keyframer::joint::JointKeyframer keyframer({});
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (auto keyframe = keyframer.add(drive.scan(k).scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

/// A mapper and what is shown of it.
struct WatchedMapper {
  smoothing::SmoothingMapper mapper;
  HealthWatch watch;

  explicit WatchedMapper(int new_map_keyframes = 3)
      : mapper([&] {
          SmoothingMapperParameters parameters;
          parameters.new_map_keyframes = new_map_keyframes;
          return parameters;
        }()) {}

  void add(const model::Keyframe& keyframe) { watch.add(mapper.add(keyframe)); }
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

model::MapUpdate update_of(model::MapUpdateStatus status, int k, double speed_mps) {
  model::MapUpdate update;
  update.status = status;
  update.utime = 800'000LL * k;
  update.map_T_vehicle = geometry::SE2(0.8 * k * speed_mps, 0.0, 0.0);
  update.degrees_of_freedom = 40;
  update.chi2 = 40.0;
  return update;
}

bool shows(const HealthWatch& watch, wire::Reason reason, std::string_view channel = "") {
  return std::ranges::any_of(watch.conditions(), [&](const bus::WatchedCondition& one) {
    return one.reason == reason && one.channel == channel && one.condition.holds();
  });
}

}  // namespace

TEST_CASE("A mapper with good keyframes is well", "[health]") {
  for (std::uint64_t seed = 61; seed <= 64; ++seed) {
    WatchedMapper watched;
    for (const model::Keyframe& keyframe : keyframes_of(seed, 100.0)) {
      watched.add(keyframe);
      REQUIRE(watched.is_well());
    }
  }
}

TEST_CASE("A mapper that was carried into another forest is lost, and well again back home",
          "[health]") {
  const std::vector<model::Keyframe> here = keyframes_of(65, 60.0);
  std::vector<model::Keyframe> there = keyframes_of(965, 30.0);
  WatchedMapper watched(0);
  const std::size_t half = here.size() / 2;
  for (std::size_t k = 0; k < half; ++k) watched.add(here[k]);
  model::Utime late_us = 0;
  for (model::Keyframe keyframe : there) {
    late_us = here[half].utime + keyframe.utime - there.front().utime;
    keyframe.previous_T_base.reset();
    keyframe.utime = late_us;
    watched.add(keyframe);
  }
  CHECK(watched.shows(wire::Reason::kLost));

  for (std::size_t k = half; k < here.size(); ++k) {
    model::Keyframe keyframe = here[k];
    keyframe.utime += late_us;
    watched.add(keyframe);
  }
  CHECK(watched.is_well());
}

TEST_CASE("A mapper that began another map says so for a while", "[health]") {
  const std::vector<model::Keyframe> here = keyframes_of(67, 30.0);
  const std::vector<model::Keyframe> there = keyframes_of(967, 100.0);
  WatchedMapper watched;
  for (const model::Keyframe& keyframe : here) watched.add(keyframe);
  CHECK(watched.is_well());
  int shown = 0;
  for (model::Keyframe keyframe : there) {
    keyframe.utime += here.back().utime + 1'000'000;
    watched.add(keyframe);
    if (watched.shows(wire::Reason::kNewMap)) ++shown;
    CHECK_FALSE(watched.shows(wire::Reason::kDiverged));
  }
  CHECK(shown == 32);
  CHECK(watched.is_well());
}

TEST_CASE("Keyframes that are malformed or late are named", "[health]") {
  WatchedMapper watched;
  const std::vector<model::Keyframe> good = keyframes_of(66, 20.0);
  for (const model::Keyframe& keyframe : good) watched.add(keyframe);
  CHECK(watched.is_well());
  for (const model::Keyframe& keyframe : good) watched.add(keyframe);
  CHECK(watched.shows(wire::Reason::kInputRefused));
  CHECK_FALSE(watched.shows(wire::Reason::kLost));
}

TEST_CASE("Keyframes that are rolled back, or fit badly, are named", "[health]") {
  using enum model::MapUpdateStatus;
  HealthWatch rolling;
  for (int k = 0; k < 8; ++k) rolling.add(update_of(k % 3 == 0 ? kRolledBack : kUpdated, k, 1.0));
  CHECK(shows(rolling, wire::Reason::kRolledBack));

  HealthWatch bad;
  for (int k = 0; k < 8; ++k) {
    model::MapUpdate update = update_of(kUpdated, k, 1.0);
    if (k % 2 == 0) update.chi2 = 90.0;
    bad.add(update);
  }
  CHECK(shows(bad, wire::Reason::kDiverged));
  for (int k = 8; k < 20; ++k) bad.add(update_of(kUpdated, k, 1.0));
  CHECK_FALSE(shows(bad, wire::Reason::kDiverged));
}

TEST_CASE("A map and a filter that move differently are named", "[health]") {
  HealthWatch watch;
  for (const double speed_mps : {1.0, 2.0}) {
    for (int k = 1; k < 20; ++k) {
      const int at = speed_mps > 1.0 ? k + 20 : k;
      model::EkfPose pose;
      pose.utime = 800'000LL * at;
      pose.ekf_map_T_vehicle = geometry::SE2(0.8 * at * speed_mps, 3.0, 0.0);
      watch.add(pose);
      watch.add(update_of(model::MapUpdateStatus::kUpdated, at, 1.0));
    }
    CHECK(shows(watch, wire::Reason::kDiverged, "EKF_POSE") == (speed_mps > 1.0));
  }
}

TEST_CASE("Keyframes that odometry alone places are named as long as they come", "[health]") {
  using enum model::MapUpdateStatus;
  HealthWatch watch;
  const auto add = [&](int k, bool is_confirmed) {
    model::MapUpdate update = update_of(kUpdated, k, 1.0);
    if (!is_confirmed) update.reason = "few landmarks match";
    watch.add(update);
  };
  for (int k = 0; k < 8; ++k) add(k, true);
  CHECK_FALSE(shows(watch, wire::Reason::kLost, "ODOMETRY"));
  for (int k = 8; k < 12; ++k) add(k, false);
  CHECK(shows(watch, wire::Reason::kLost, "ODOMETRY"));
  for (int k = 12; k < 24; ++k) add(k, true);
  CHECK_FALSE(shows(watch, wire::Reason::kLost, "ODOMETRY"));
}

TEST_CASE("A loop closure that contradicts the graph is in HEALTH for fifty keyframes",
          "[health]") {
  using Status = model::LoopResult::Status;
  const auto keyframes_shown = [](Status status, const std::string& reason) {
    HealthWatch watch;
    model::LoopResult result;
    result.status = status;
    result.reason = reason;
    watch.add(result);
    int shown = 0;
    for (int k = 0; k < 100; ++k) {
      watch.add(update_of(model::MapUpdateStatus::kUpdated, k, 1.0));
      if (shows(watch, wire::Reason::kDiverged, "LOOP_CLOSURE")) ++shown;
    }
    return shown;
  };
  CHECK(keyframes_shown(Status::kWaiting, "it contradicts the graph") == 50);
  CHECK(keyframes_shown(Status::kAccepted, "variances are 9 times those stated") == 50);
  CHECK(keyframes_shown(Status::kAccepted, "") == 0);
  CHECK(keyframes_shown(Status::kRefused, "it is of another map") == 0);
}
