// Coordinates of reference systems as metres of a map's frame.
#include <cmath>
#include <numbers>
#include <random>

#include "common/reference_system/reference_system.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::reference_system;
using Catch::Matchers::Contains;

namespace {

/// A system, a place in the middle of its area (easting and northing, or longitude and latitude),
/// and what one unit is in metres there (0: degrees).
struct Case {
  const char* system;
  Eigen::Vector2d middle;
  double unit_m;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> kCases{
      {"EPSG:25832", {401234.567, 5654321.001}, 1.0},
      {"EPSG:25833", {391000.0, 5820000.0}, 1.0},
      {"EPSG:32632", {691000.0, 5335000.0}, 1.0},
      {"EPSG:32719", {345000.0, 6298000.0}, 1.0},
      {"EPSG:2154", {652000.0, 6862000.0}, 1.0},
      {"EPSG:2180", {637000.0, 487000.0}, 1.0},
      {"EPSG:3006", {674000.0, 6580000.0}, 1.0},
      {"EPSG:3067", {386000.0, 6672000.0}, 1.0},
      {"EPSG:27700", {530000.0, 180000.0}, 1.0},
      {"EPSG:31468", {4468000.0, 5334000.0}, 1.0},
      {"EPSG:27572", {600000.0, 2428000.0}, 1.0},
      {"EPSG:2225", {6048000.0, 2200000.0}, 1200.0 / 3937.0},
      {"EPSG:5555", {401234.0, 5654321.0}, 1.0},
      {"EPSG:4326", {7.589, 51.0456}, 0.0},
      {"EPSG:4326", {-70.65, -33.44}, 0.0},
  };
  return kCases;
}

/// A step of so many metres from a place, in the units of the system, roughly.
Eigen::Vector2d stepped(const Case& one, const Eigen::Vector2d& from, const Eigen::Vector2d& by_m) {
  if (one.unit_m > 0.0) return from + by_m / one.unit_m;
  constexpr double kPerDegreeM = 111'320.0;
  const double cosine = std::cos(from.y() * std::numbers::pi / 180.0);
  return from + Eigen::Vector2d(by_m.x() / (kPerDegreeM * cosine), by_m.y() / kPerDegreeM);
}

Eigen::Vector2d random_step_m(std::mt19937_64& random, double reach_m) {
  std::uniform_real_distribution<double> side(-reach_m, reach_m);
  const double x = side(random);
  return {x, side(random)};
}

/// Length of the geodesic between two places of WGS 84 (longitude and latitude), by the radii of
/// curvature in the middle: exact to 1e-9 of it over a kilometre.
double geodesic_m(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  constexpr double kRadiusM = 6378137.0;
  constexpr double kSquare = 0.00669437999014132;
  constexpr double kRad = std::numbers::pi / 180.0;
  const double sine = std::sin(0.5 * (a.y() + b.y()) * kRad);
  const double w = std::sqrt(1.0 - kSquare * sine * sine);
  const double north_m = kRadiusM * (1.0 - kSquare) / (w * w * w) * (b.y() - a.y()) * kRad;
  const double east_m = kRadiusM / w * std::sqrt(1.0 - sine * sine) * (b.x() - a.x()) * kRad;
  return std::hypot(north_m, east_m);
}

}  // namespace

TEST_CASE("coordinates go into a frame and come back to the hundredth of a millimetre",
          "[reference_system]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (const Case& one : cases()) {
    CAPTURE(one.system);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d origin = stepped(one, one.middle, random_step_m(random, 20e3));
      const auto frame = frame_at(one.system, origin, i % 2 == 0 ? 0.0 : angle(random));
      const Transformation into = into_frame(one.system, frame);
      CHECK(into.forward(origin).norm() < 1e-5);
      for (int k = 0; k < 20; ++k) {
        const Eigen::Vector2d at = stepped(one, origin, random_step_m(random, 5e3));
        const Eigen::Vector2d local_m = into.forward(at);
        CHECK(local_m.norm() < 7.2e3);
        const double unit_m = one.unit_m > 0.0 ? one.unit_m : 111'320.0;
        CHECK(unit_m * (into.inverse(local_m) - at).norm() < 1e-5);
      }
    }
  }
}

TEST_CASE("a metre of the frame is a metre on the ellipsoid, whatever the grid's scale",
          "[reference_system]") {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (const Case& one : cases()) {
    // Other datums have other ellipsoids: their own length of a degree.
    const std::string system = one.system;
    const bool is_on_wgs84 = system == "EPSG:4326" || system.starts_with("EPSG:32");
    if (!is_on_wgs84) continue;
    CAPTURE(one.system);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d origin = stepped(one, one.middle, random_step_m(random, 20e3));
      const auto frame = frame_at(one.system, origin, angle(random));
      const Transformation earth = to_wgs84(frame);
      const Eigen::Vector2d a_m = random_step_m(random, 500.0);
      const Eigen::Vector2d b_m = a_m + random_step_m(random, 500.0);
      const double true_m = geodesic_m(earth.forward(a_m), earth.forward(b_m));
      CHECK(std::abs((b_m - a_m).norm() - true_m) < 5e-5);
    }
  }
}

TEST_CASE("both ways to WGS 84 lead to the same place", "[reference_system]") {
  std::mt19937_64 random(3);
  for (const Case& one : cases()) {
    CAPTURE(one.system);
    const auto frame = frame_at(one.system, one.middle, 0.7);
    const Transformation into = into_frame(one.system, frame);
    const Transformation earth = to_wgs84(frame);
    const Transformation direct(one.system, "EPSG:4326",
                                Geographic{frame.latitude_deg, frame.longitude_deg});
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector2d at = stepped(one, one.middle, random_step_m(random, 5e3));
      CHECK((earth.forward(into.forward(at)) - direct.forward(at)).norm() < 1e-9);
    }
    CHECK((earth.forward({0.0, 0.0}) - Eigen::Vector2d(frame.longitude_deg, frame.latitude_deg))
              .norm() < 0.01);
  }
}

TEST_CASE("y points north, and a turned frame lies to the left of it", "[reference_system]") {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (const Case& one : cases()) {
    CAPTURE(one.system);
    const auto straight = frame_at(one.system, one.middle);
    const Eigen::Vector2d north = to_wgs84(straight).forward({0.0, 100.0});
    const Eigen::Vector2d origin = to_wgs84(straight).forward({0.0, 0.0});
    CHECK(std::abs(north.x() - origin.x()) < 1e-7);
    CHECK(north.y() > origin.y() + 0.0008);

    const double rotation_rad = angle(random);
    const auto turned = frame_at(one.system, one.middle, rotation_rad);
    const Transformation into(turned.definition, straight.definition);
    const Eigen::Vector2d there_m = into.forward({100.0, 0.0});
    CHECK(std::abs(std::remainder(std::atan2(there_m.y(), there_m.x()) - rotation_rad,
                                  2.0 * std::numbers::pi)) < 1e-8);
  }
}

TEST_CASE("the worked example of EPSG's guidance note 7-2 (27700)", "[reference_system]") {
  const auto frame = frame_at("EPSG:27700", {577274.99, 69740.50});
  CHECK(std::abs(frame.latitude_deg - 50.5) < 1e-7);
  CHECK(std::abs(frame.longitude_deg - 0.5) < 1e-7);
  CHECK(frame.system == "EPSG:27700");
  // The scale factor there is 1.0000... of the grid: 1 km of it is 1 km less 0.4 m at 400 km east.
  const double grid_m = into_frame("EPSG:27700", frame).forward({578274.99, 69740.50}).norm();
  CHECK(std::abs(grid_m - 1000.0) > 0.01);
}

TEST_CASE("systems are known by code and by name; units and kinds are told", "[reference_system]") {
  CHECK(summary_of("ETRS89 / UTM zone 32N").code == "EPSG:25832");
  CHECK(summary_of("EPSG:25832").name == "ETRS89 / UTM zone 32N");
  CHECK(summary_of("EPSG:2225").unit == Approx(1200.0 / 3937.0).epsilon(1e-12));
  CHECK(summary_of("EPSG:4326").is_geographic);
  CHECK(summary_of("EPSG:4326").unit == Approx(1.0));
  CHECK(summary_of("EPSG:5555").code == "EPSG:25832");
  const auto frame = frame_at("EPSG:2154", {652000.0, 6862000.0});
  CHECK_FALSE(summary_of(frame.definition).is_geographic);
}

TEST_CASE("what is no horizontal system is refused by its name", "[reference_system]") {
  const auto refused = [](const std::string& system, const std::string& why) {
    CAPTURE(system);
    CHECK_THROWS_WITH(summary_of(system), Contains(system) && Contains(why) && !Contains("\n"));
    CHECK_THROWS_AS(frame_at(system, {0.0, 0.0}), ReferenceError);
  };
  refused("EPSG:99999", "no reference system of this name is known");
  refused("EPSG:", "no reference system of this name is known");
  refused("25832", "write EPSG:25832");
  refused("UTM", "no reference system of this name is known");
  refused("+proj=utm +zone=32", "no reference system of this name is known");
  refused("EPSG:4979", "has heights");
  refused("EPSG:4978", "is geocentric");
  refused("EPSG:7837", "is a system of heights");
  refused("EPSG:2053", "its axes point");
  refused("EPSG:3031", "its axes point");
  CHECK_THROWS_WITH(
      summary_of(R"(LOCAL_CS["plot 7",UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]])"),
      Contains("plot 7") && Contains("is an engineering system"));
}

TEST_CASE("places beyond a system's reach and area are told", "[reference_system]") {
  const auto frame = frame_at("EPSG:25832", {401234.0, 5654321.0});
  CHECK_THROWS_AS(into_frame("EPSG:4326", frame).forward({7.0, 95.0}), ReferenceError);
  CHECK_THROWS_AS(frame_at("EPSG:4326", {7.0, 89.5}), ReferenceError);
  CHECK_FALSE(outside_area("EPSG:25832", {401234.0, 5654321.0}));
  const auto swapped = outside_area("EPSG:25832", {5654321.0, 401234.0});
  REQUIRE(swapped);
  CHECK_THAT(swapped->text, Contains("swapped") && Contains("EPSG:25832"));
  CHECK(swapped->distance_m > 2e6);
  // Half a degree east of the zone at 52 degrees of latitude.
  const auto beside = outside_area("EPSG:25832", {740600.0, 5766000.0});
  REQUIRE(beside);
  CHECK(beside->distance_m == Approx(34e3).margin(1e3));
  CHECK_THAT(beside->text,
             Contains("is 35 km outside of the area") || Contains("is 34 km outside"));
  CHECK(outside_area("EPSG:27700", {5300000.0, 180000.0})->distance_m > 1e6);

  // Fiji's system lies across the date line, from 176.81 to -178.15.
  const Transformation into("EPSG:4326", "EPSG:3460");
  for (const double longitude_deg : {177.0, 179.99, -179.99, -179.0})
    CHECK_FALSE(outside_area("EPSG:3460", into.forward({longitude_deg, -17.0})));
  CHECK(outside_area("EPSG:3460", into.forward({175.81, -17.0}))->distance_m ==
        Approx(106e3).margin(2e3));
  CHECK(outside_area("EPSG:3460", into.forward({-177.15, -17.0}))->distance_m ==
        Approx(106e3).margin(2e3));
}

TEST_CASE("how well two datums are known to each other is told", "[reference_system]") {
  const auto accuracy = [](const std::string& system, const Eigen::Vector2d& origin,
                           const std::string& from, const Eigen::Vector2d& at) {
    const Transformation into = into_frame(from, frame_at(system, origin));
    into.forward(at);
    return into.accuracy_m();
  };
  CHECK(accuracy("EPSG:25832", {401234.0, 5654321.0}, "EPSG:25832", {401234.0, 5654321.0}) == 0.0);
  CHECK(accuracy("EPSG:31468", {4468000.0, 5334000.0}, "EPSG:32632", {691000.0, 5335000.0})
            .value_or(99.0) > 0.5);
}
