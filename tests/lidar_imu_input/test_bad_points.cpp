// Which points of a sweep are left out.
#include <limits>
#include <vector>

#include "services/lidar_imu_input/deskew.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

TEST_CASE("near points are left out, and those that cannot be are counted", "[stage][deskew]") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  model::PointSweep sweep;
  const auto add = [&](float x_m, float y_m, float z_m, float time_s) {
    model::SweepPoint& point = sweep.points.emplace_back();
    point.x_m = x_m;
    point.y_m = y_m;
    point.z_m = z_m;
    point.time_s = time_s;
  };
  add(0.0F, -2.01F, 0.0F, 0.0F);
  add(1.2F, 1.2F, -1.2F, 1.0F);
  add(0.0F, -1.99F, 0.0F, 0.0F);
  add(1.1F, 1.1F, -1.1F, 0.5F);
  add(10.0F, 0.0F, 0.0F, 1.001F);
  add(10.0F, 0.0F, 0.0F, -0.001F);
  add(10.0F, 0.0F, 0.0F, nan);
  add(10.0F, nan, 0.0F, 0.5F);

  REQUIRE(remove_bad_points(sweep, 2.0) == 4);
  REQUIRE(sweep.points.size() == 2);
  CHECK(sweep.points[0].y_m == -2.01F);
  CHECK(sweep.points[1].time_s == 1.0F);
}
