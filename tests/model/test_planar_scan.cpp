// Beams of a one-plane laser.
#include "common/model/planar_scan.hpp"

#include <cmath>
#include <limits>

#include "tests/catch.hpp"

using namespace understory;

TEST_CASE("Beams are evenly apart, from the first one on, to either side", "[model]") {
  for (const double step_rad : {-0.01, 0.005}) {
    model::PlanarScan scan;
    scan.first_bearing_rad = -1.5;
    scan.bearing_step_rad = step_rad;
    CHECK(scan.bearing(0) == -1.5);
    for (std::size_t k = 1; k < 300; ++k)
      CHECK(scan.bearing(k) - scan.bearing(k - 1) == Approx(step_rad));
  }
}

TEST_CASE("A scan ends with its last beam", "[model]") {
  model::PlanarScan scan;
  scan.utime = 7'000'000;
  scan.beam_interval_s = 1e-4;
  CHECK(scan.end() == 7'000'000);
  scan.ranges_m.assign(361, 5.0F);
  CHECK(scan.duration_s() == Approx(0.036));
  CHECK(scan.end() == 7'036'000);
}

TEST_CASE("A return is a positive range below the largest", "[model]") {
  model::PlanarScan scan;
  scan.max_range_m = 80.0;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  scan.ranges_m = {0.0F, -1.0F, nan, 80.0F, 81.0F, 0.01F, 79.99F};
  for (std::size_t k = 0; k < scan.ranges_m.size(); ++k) CHECK(scan.is_return(k) == (k >= 5));
}
