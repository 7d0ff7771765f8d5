// Rays along the sides of a box.
#include "sim/shapes.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;

TEST_CASE("A ray parallel to a box's sides meets it where it is between them", "[shapes]") {
  const Box box{{10.0, 0.0, 1.0}, {2.0, 0.5, 1.0}, 0.0};
  const auto meets_at = [&](double y_m, double z_m) {
    return meet(Ray{{0.0, y_m, z_m}, Eigen::Vector3d::UnitX()}, box);
  };
  for (const double y_m : {-0.49, 0.0, 0.49}) {
    for (const double z_m : {0.01, 1.0, 1.99}) {
      const auto hit = meets_at(y_m, z_m);
      REQUIRE(hit);
      CHECK(hit->range_m == Approx(8.0));
      CHECK(hit->cosine == 1.0);
    }
  }
  CHECK_FALSE(meets_at(0.51, 1.0));
  CHECK_FALSE(meets_at(-0.51, 1.0));
  CHECK_FALSE(meets_at(0.0, 2.01));
  CHECK_FALSE(meets_at(0.0, -0.01));
  // From within, and away from it.
  CHECK_FALSE(meet(Ray{{10.0, 0.0, 1.0}, Eigen::Vector3d::UnitX()}, box));
  CHECK_FALSE(meet(Ray{{13.0, 0.0, 1.0}, Eigen::Vector3d::UnitX()}, box));
}
