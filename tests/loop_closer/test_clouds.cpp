// Detectors and verifiers that compare clouds.
#include <fmt/format.h>

#include "services/loop_closer/health_watch.hpp"
#include "services/loop_closer/place_clouds.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/chosen_search.hpp"

using namespace understory;
using namespace understory::loop_closer;
using test::chosen;
using test::Found;
using test::ReckoningMapper;
using test::ring;
using test::RingDrive;

TEST_CASE("Every detector and verifier for clouds closes loops, and no wrong ones",
          "[loop_closer][clouds]") {
  const std::vector<std::pair<std::string, std::string>> choices{
      {"scan_context", "correspondence_graph"},
      {"range_histogram", "correspondence_graph"},
      {"scan_context", "generalised_icp"},
      {"constellation", "icp_point_to_point"},
      {"constellation", "icp_point_to_plane"},
      {"constellation", "scan_context"},
      {"stems", "generalised_icp"},
      {"stems", "scan_context"}};
  for (const auto& [detector, verifier] : choices) {
    Found found;
    for (std::uint64_t seed = 81; seed <= 84; ++seed)
      count(RingDrive(ring(seed, 1.5)), chosen(detector, verifier), found, true);
    CAPTURE(detector, verifier);
    WARN(fmt::format("{} and {}: {} of {} queries sent, {} wrong", detector, verifier, found.sent,
                     found.queries, found.wrong));
    CHECK(found.wrong == 0);
    CHECK(found.sent > 0);
  }
}

TEST_CASE("Where nothing is seen again no cloud closes anything", "[loop_closer][clouds]") {
  for (const std::string verifier : {"correspondence_graph", "generalised_icp"}) {
    Found found;
    for (std::uint64_t seed = 91; seed <= 94; ++seed) {
      test::RingOptions options = ring(seed, 0.9);
      options.radius_m = 80.0;
      count(RingDrive(options), chosen("scan_context", verifier), found, true);
    }
    CAPTURE(verifier, found.queries);
    CHECK(found.queries > 20);
    CHECK(found.sent == 0);
  }
}

TEST_CASE("Without clouds nothing is compared with them, and HEALTH says so",
          "[loop_closer][clouds]") {
  const RingDrive drive(ring(81, 1.5));
  LoopCloser closer(chosen("scan_context", "correspondence_graph"));
  HealthWatch watch;
  ReckoningMapper mapper(drive);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    const LoopCounters before = closer.counters();
    closer.add(drive.keyframe_at(k));
    CHECK_FALSE(closer.add(mapper.update(k)));
    watch.add(before, closer.counters());
  }
  CHECK(closer.counters().without_cloud > 20);
  CHECK(closer.memory().places().empty());
  CHECK(watch.conditions().back().condition.holds());
  CHECK(watch.conditions().back().channel == "PLACE_SCAN");

  // Nobody else misses them.
  LoopCloser by_stems(chosen("stems", "none"));
  ReckoningMapper again(drive);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    by_stems.add(drive.cloud_at(k));
    by_stems.add(drive.keyframe_at(k));
    (void)by_stems.add(again.update(k));
  }
  CHECK(by_stems.counters().without_cloud == 0);
  REQUIRE(by_stems.memory().places().size() > 20);
  for (const Place& place : by_stems.memory().places()) CHECK(place.cloud.empty());
}

TEST_CASE("A cloud lies around the base of its place as it was seen", "[loop_closer][clouds]") {
  // A keyframe of three scans, the cloud of the second one.
  const geometry::SE2 map_T_base(4.0, -2.0, 0.7);
  const geometry::SE2 base_T_scan(1.5, 0.3, -0.2);
  model::Keyframe keyframe;
  keyframe.utime = 100;
  const geometry::SE2 base_T_centre(0.8, 0.1, 0.05);
  keyframe.members.push_back({100, 0, base_T_centre.inverse(), Eigen::Matrix3d::Zero()});
  keyframe.members.push_back({200, 1, base_T_centre.inverse() * base_T_scan, {}});
  keyframe.members.push_back({300, 2, base_T_centre.inverse() * base_T_scan, {}});
  model::MapUpdate update;
  update.map_T_vehicle = map_T_base * base_T_centre * keyframe.centre_T_base();

  const Eigen::Vector3f in_scan(10.0F, -3.0F, 1.2F);
  PlaceClouds clouds;
  clouds.add({50, 0, {model::place_point(in_scan)}});
  clouds.add(keyframe, update, 20.0);
  CHECK(clouds.seen_from(update.map_T_vehicle, 0.0).empty());
  clouds.add({200, 1, {model::place_point(in_scan)}});
  clouds.add(keyframe, update, 20.0);

  const geometry::SE2 viewer(5.0, 1.0, -1.0);
  const auto seen = clouds.seen_from(viewer, 19.0);
  REQUIRE(seen.size() == 1);
  const Eigen::Vector2d expected =
      viewer.inverse() * (map_T_base * (base_T_scan * Eigen::Vector2d(10.0, -3.0)));
  CHECK((seen[0].position_m().head<2>().cast<double>() - expected).norm() < 0.011);
  CHECK(seen[0].z_cm == 120);

  CHECK(clouds.seen_from(viewer, 21.0).empty());
  clouds.restart();
  CHECK(clouds.seen_from(viewer, 0.0).empty());
}

TEST_CASE("A restarted loop closer has its clouds again, to the byte", "[loop_closer][clouds]") {
  const RingDrive drive(ring(82, 1.5));
  CHECK(test::same_after_restarts(drive, chosen("scan_context", "correspondence_graph"), true) > 0);
}
