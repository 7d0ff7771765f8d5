// Scans with more landmarks than the filter's map holds.
#include "services/ekf/ekf.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::ekf;

namespace {

/// 500 landmarks 2 m apart, of which the field of view, as stated, contains none.
model::TrackedScan unseen_crowd(int number) {
  model::TrackedScan scan;
  scan.utime = 1000000 + 100000 * number;
  scan.sequence = static_cast<std::uint64_t>(number);
  scan.field_of_view = {.max_range_m = 400.0, .bearing_rad = 3.0, .width_rad = 1e-9};
  for (std::uint32_t i = 0; i < 500; ++i) {
    model::TrackedLandmark& one = scan.landmarks.emplace_back();
    one.track_id = 1000 * static_cast<model::TrackId>(number) + i + 1;
    one.detection = i;
    one.observed.position_m = {2.0 * (i % 25), 2.0 * (i / 25), 0.0};
    one.observed.covariance_m2 = 0.01 * Eigen::Matrix3d::Identity();
  }
  return scan;
}

}  // namespace

TEST_CASE("A scan's landmarks do not push each other out of a full map", "[ekf]") {
  EkfParameters parameters;
  parameters.map.max_landmarks = 20;
  Ekf ekf(parameters);
  ekf.add(unseen_crowd(0));
  CHECK(ekf.counters().removed == 0);

  // Those of an earlier scan make room, once each.
  for (int scan = 1; scan < 4; ++scan) ekf.add(unseen_crowd(scan));
  CHECK(ekf.counters().removed <= 3 * 20);
}
