// Where a sensor can detect landmarks.
#include "common/model/landmarks.hpp"

#include <cmath>
#include <numbers>

#include "tests/catch.hpp"

using namespace understory;

namespace {

Eigen::Vector2d at(double range_m, double bearing_rad) {
  return {range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad)};
}

}  // namespace

TEST_CASE("A field of view is a sector of a disc", "[model]") {
  // To the rear left, across the half turn.
  const model::FieldOfView view{.max_range_m = 20.0, .bearing_rad = 2.8, .width_rad = 1.2};
  for (const double side : {-1.0, 1.0}) {
    CHECK(view.contains(at(19.9, 2.8 + 0.59 * side)));
    CHECK_FALSE(view.contains(at(20.1, 2.8 + 0.59 * side)));
    CHECK_FALSE(view.contains(at(5.0, 2.8 + 0.61 * side)));
  }
  CHECK_FALSE(view.contains(at(5.0, 2.8 - std::numbers::pi)));
}

TEST_CASE("A field of view of a whole turn has no edge", "[model]") {
  const model::FieldOfView view{.max_range_m = 20.0, .bearing_rad = 1.0};
  for (double bearing_rad = -3.1; bearing_rad < 3.2; bearing_rad += 0.1) {
    CHECK(view.contains(at(19.9, bearing_rad)));
    CHECK_FALSE(view.contains(at(20.1, bearing_rad)));
  }
}
