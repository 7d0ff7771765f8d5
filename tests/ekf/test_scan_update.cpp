// What the filter takes from a scan, and when a scan is at odds with the map.
#include "services/ekf/scan_update.hpp"

#include <limits>

#include "services/ekf/filter_state.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::ekf;

namespace {

constexpr double kHeight_m = 1.5;

/// A scan of one landmark; `height_variance_m2`: of its height.
model::TrackedScan scan_of(double x_m, double y_m, double height_variance_m2) {
  model::TrackedLandmark landmark;
  landmark.track_id = 7;
  landmark.observed.position_m << x_m, y_m, kHeight_m;
  landmark.observed.covariance_m2.diagonal() << 0.02, 0.02, height_variance_m2;
  model::TrackedScan scan;
  scan.landmarks.push_back(landmark);
  return scan;
}

ScanUpdate counted(std::uint32_t refused, std::uint32_t used) {
  ScanUpdate update;
  update.refused = refused;
  update.used = used;
  return update;
}

}  // namespace

TEST_CASE("Only a detection as uncertain as the level was levelled", "[ekf]") {
  // Of roll and pitch. Ahead, pitch moves the height: 0.04 m^2 at 10 m; at the left, roll: 0.01
  // m^2.
  const Eigen::Matrix2d level = Eigen::Vector2d(1e-4, 4e-4).asDiagonal();
  struct Case {
    double x_m, y_m, height_variance_m2;
    bool is_levelled;
  };
  for (const Case& one : {Case{10.0, 0.0, 0.018, false}, Case{10.0, 0.0, 0.022, true},
                          Case{0.0, 10.0, 0.004, false}, Case{0.0, 10.0, 0.006, true},
                          Case{6.0, -8.0, 0.010, false}, Case{6.0, -8.0, 0.011, true}}) {
    const model::TrackedScan scan = scan_of(one.x_m, one.y_m, one.height_variance_m2);
    const ScanUpdate update = read_scan(scan, level);
    REQUIRE(update.observations.size() == 1);
    const Observation& observation = update.observations.front();
    REQUIRE(observation.height_m == (one.is_levelled ? kHeight_m : 0.0));
    const Eigen::Matrix2d given = scan.landmarks[0].observed.covariance_m2.topLeftCorner<2, 2>();
    REQUIRE((observation.covariance_m2 == given) != one.is_levelled);
    REQUIRE(read_scan(scan, std::nullopt).observations.front().height_m == 0.0);
  }
}

TEST_CASE("Observations without a track or a proper covariance are left out", "[ekf]") {
  model::TrackedScan scan = scan_of(5.0, 1.0, 0.1);
  scan.landmarks.resize(5, scan.landmarks.front());
  scan.landmarks[0].track_id = 0;
  scan.landmarks[1].observed.position_m.z() = std::numeric_limits<double>::quiet_NaN();
  scan.landmarks[2].observed.covariance_m2(0, 1) = scan.landmarks[2].observed.covariance_m2(1, 0) =
      0.03;
  scan.landmarks[3].track_id = 9;
  const ScanUpdate update = read_scan(scan, std::nullopt);
  REQUIRE(update.scan_index == std::vector<std::uint32_t>{3, 4});
  REQUIRE(update.tracks == std::vector<model::TrackId>{9, 7});
  REQUIRE(update.is_settled == std::vector<bool>{false, false});
}

TEST_CASE("A scan is at odds with the map where most of it was refused", "[ekf]") {
  REQUIRE(is_at_odds(counted(4, 0)));
  REQUIRE(!is_at_odds(counted(3, 0)));
  REQUIRE(is_at_odds(counted(7, 3)));
  REQUIRE(!is_at_odds(counted(6, 3)));
}
