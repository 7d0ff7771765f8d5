// Errors of single poses.
#include "deploy/cli/drive_accuracy.hpp"

#include <cmath>
#include <numbers>

#include "tests/catch.hpp"

using namespace understory;

TEST_CASE("A pose's errors do not depend on where and which way it is", "[cli]") {
  const geometry::SE2 error(0.3, -0.4, 0.05);
  for (double heading_rad = -9.0; heading_rad < 9.0; heading_rad += 0.37) {
    const geometry::SE2 truth(100.0 * heading_rad, -7.0, heading_rad);
    const cli::ComparedPose worse{0, truth * error, truth};
    CHECK(worse.position_error_m() == Approx(0.5));
    CHECK(worse.heading_error_rad() == Approx(0.05));
    const cli::ComparedPose other_way{0, truth, truth * error};
    CHECK(other_way.heading_error_rad() == Approx(0.05));
    CHECK(cli::ComparedPose{0, truth, truth}.heading_error_rad() == Approx(0.0).margin(1e-12));
    const cli::ComparedPose backwards{0, truth * geometry::SE2(0.0, 0.0, std::numbers::pi), truth};
    CHECK(backwards.heading_error_rad() == Approx(std::numbers::pi));
  }
}
