// Lines of sight by the ranges of a sweep, also of a sensor that moved meanwhile.
#include "common/model/view_ranges.hpp"

#include <cmath>
#include <numbers>

#include "tests/catch.hpp"

using namespace understory::model;

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// All bins the same.
ViewRanges everywhere(double free_m, double hidden_m) {
  ViewRanges ranges;
  ranges.step_rad = kTurn / 720;
  ranges.beam_step_rad = 0.003;
  ranges.free.assign(720, static_cast<std::uint8_t>(free_m / ranges.range_step_m));
  ranges.hidden.assign(720, static_cast<std::uint8_t>(hidden_m / ranges.range_step_m));
  return ranges;
}

/// Sets the bins whose rays (from where the sensor was) meet a disc.
void hide_behind(const Eigen::Vector2d& disc_m, double radius_m, ViewRanges& ranges) {
  for (std::size_t bin = 0; bin < ranges.free.size(); ++bin) {
    const double bearing =
        ranges.first_bearing_rad + (static_cast<double>(bin) + 0.5) * ranges.step_rad;
    const Eigen::Vector2d ray(std::cos(bearing), std::sin(bearing));
    const Eigen::Vector2d to_m = disc_m - ranges.sensor_at(bin);
    const double along_m = to_m.dot(ray);
    const double beside_m = std::abs(ray.x() * to_m.y() - ray.y() * to_m.x());
    if (along_m < 0.0 || beside_m > radius_m) continue;
    ranges.free[bin] = ranges.hidden[bin] = static_cast<std::uint8_t>(along_m / 0.25);
  }
}

}  // namespace

TEST_CASE("clear, blocked, or not known", "[view]") {
  const Eigen::Vector2d place(10.0, 0.0);
  CHECK(line_of_sight(everywhere(20.0, 0.0), place, 0.2) == LineOfSight::kClear);
  CHECK(line_of_sight(everywhere(5.0, 5.0), place, 0.2) == LineOfSight::kBlocked);
  CHECK(line_of_sight(everywhere(5.0, 0.0), place, 0.2) == LineOfSight::kUnknown);
  CHECK(line_of_sight(everywhere(9.75, 9.75), place, 0.2) == LineOfSight::kBlocked);
  CHECK(line_of_sight(everywhere(0.0, 0.0), place, 0.2) == LineOfSight::kUnknown);
  CHECK(line_of_sight({}, place, 0.2) == LineOfSight::kUnknown);
  CHECK(line_of_sight(everywhere(20.0, 0.0), {0.2, 0.0}, 0.2) == LineOfSight::kUnknown);
  // Beams may pass beside what is thin.
  CHECK(line_of_sight(everywhere(20.0, 0.0), place, 0.02) == LineOfSight::kUnknown);
  CHECK(line_of_sight(everywhere(40.0, 0.0), {30.0, 0.0}, 0.0) == LineOfSight::kUnknown);

  // One bin that says otherwise.
  ViewRanges ranges = everywhere(20.0, 0.0);
  ranges.free[1] = 4;
  CHECK(line_of_sight(ranges, place, 0.2) == LineOfSight::kUnknown);
  CHECK(line_of_sight(ranges, {0.0, 10.0}, 0.2) == LineOfSight::kClear);
}

TEST_CASE("bins to the left, to the right, from anywhere, in a sector", "[view]") {
  for (const double direction : {1.0, -1.0}) {
    for (double first = -6.0; first < 6.0; first += 0.7) {
      ViewRanges ranges = everywhere(30.0, 0.0);
      ranges.step_rad *= direction;
      ranges.first_bearing_rad = first;
      hide_behind({-6.0, 2.0}, 1.0, ranges);
      CAPTURE(direction, first);
      CHECK(line_of_sight(ranges, {-12.0, 4.0}, 0.2) == LineOfSight::kBlocked);
      CHECK(line_of_sight(ranges, {12.0, 4.0}, 0.2) == LineOfSight::kClear);
    }
  }
  ViewRanges ahead = everywhere(30.0, 0.0);
  ahead.first_bearing_rad = -0.25 * kTurn;
  ahead.free.resize(360);
  ahead.hidden.resize(360);
  CHECK(line_of_sight(ahead, {12.0, 0.0}, 0.2) == LineOfSight::kClear);
  CHECK(line_of_sight(ahead, {-12.0, 0.0}, 0.2) == LineOfSight::kUnknown);
}

TEST_CASE("the sensor looked from where it was", "[view]") {
  ViewRanges ranges = everywhere(30.0, 0.0);
  ranges.sensor_m = {1.0, 0.0};
  ranges.turn_m = {2.0, 0.0};
  CHECK(ranges.sensor_at(0).x() == Approx(-1.0).margin(0.01));
  CHECK(ranges.sensor_at(719).x() == Approx(1.0).margin(0.01));
  // To the left it looked from x = -0.5.
  hide_behind({-0.5, 4.0}, 0.3, ranges);
  CHECK(line_of_sight(ranges, {-0.5, 20.0}, 0.2) == LineOfSight::kBlocked);
  CHECK(line_of_sight(ranges, {1.5, 20.0}, 0.2) == LineOfSight::kClear);
}
