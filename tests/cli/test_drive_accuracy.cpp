// Errors of single poses.
#include "deploy/cli/drive_accuracy.hpp"

#include <cmath>

#include "tests/catch.hpp"

using namespace understory;

TEST_CASE("A pose's error does not depend on where and which way it is", "[cli]") {
  const geometry::SE2 error(0.3, -0.4, 0.05);
  for (double heading_rad = -9.0; heading_rad < 9.0; heading_rad += 0.37) {
    const geometry::SE2 truth(100.0 * heading_rad, -7.0, heading_rad);
    const cli::ComparedPose worse{0, truth * error, truth};
    CHECK(worse.position_error_m() == Approx(0.5));
  }
}
