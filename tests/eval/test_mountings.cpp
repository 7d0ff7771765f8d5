// Wrong mountings as the campaign draws them.
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <stdexcept>

#include "eval/experiments/mountings/mounting_fault.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments::mountings;

namespace {

model::PointSweep any_sweep(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  model::PointSweep sweep;
  sweep.rings = 4;
  for (int i = 0; i < 40; ++i) {
    model::SweepPoint& point = sweep.points.emplace_back();
    point.x_m = static_cast<float>(10.0 * normal(random));
    point.y_m = static_cast<float>(10.0 * normal(random));
    point.z_m = static_cast<float>(normal(random));
    point.time_s = 0.0025F * static_cast<float>(i);
    point.ring = static_cast<std::uint16_t>(i % 4);
  }
  return sweep;
}

bool is_same(const model::PointSweep& a, const model::PointSweep& b) {
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (a.points[i].position() != b.points[i].position() || a.points[i].ring != b.points[i].ring ||
        a.points[i].time_s != b.points[i].time_s)
      return false;
  }
  return a.utime == b.utime;
}

}  // namespace

TEST_CASE("Each fault changes its own sensor and no other", "[mountings]") {
  std::mt19937_64 random(1);
  for (const std::string& kind : mounting_kinds()) {
    for (int trial = 0; trial < 5; ++trial) {
      const MountingFault fault = draw_fault(kind, random);
      CHECK(fault.kind == kind);
      model::ImuSample imu;
      imu.angular_rate_rad_s << 0.1, -0.2, 0.3;
      imu.specific_force_mps2 << 1.0, 2.0, 9.0;
      const model::ImuSample imu_before = imu;
      apply(fault, imu);
      CHECK((imu.angular_rate_rad_s != imu_before.angular_rate_rad_s ||
             imu.specific_force_mps2 != imu_before.specific_force_mps2) ==
            (fault.culprit == Culprit::kImu));

      model::WheelSample wheels;
      wheels.speed_mps = 3.0;
      wheels.steering_rad = 0.1;
      apply(fault, wheels);
      CHECK((wheels.speed_mps != 3.0 || wheels.steering_rad != 0.1) ==
            (fault.culprit == Culprit::kWheels));
      model::PointSweep sweep = any_sweep(random);
      const model::PointSweep sweep_before = sweep;
      apply(fault, sweep);
      CHECK(is_same(sweep, sweep_before) == (fault.culprit != Culprit::kLidar));
      CHECK(std::ranges::is_sorted(sweep.points, {}, &model::SweepPoint::time_s));
    }
  }
  CHECK_THROWS_AS(draw_fault("no such thing", random), std::invalid_argument);
}

TEST_CASE("Faults follow from the seed and differ between draws", "[mountings]") {
  std::set<std::string> values;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 one(seed);
    std::mt19937_64 other(seed);
    const MountingFault fault = draw_fault("LIDAR yaw 2 to 10 deg", one);
    CHECK(fault.points == draw_fault("LIDAR yaw 2 to 10 deg", other).points);
    const double yaw_deg = std::abs(std::atan2(fault.points(1, 0), fault.points(0, 0))) * 57.29578;
    CHECK(yaw_deg > 1.99);
    CHECK(yaw_deg < 10.01);
    values.insert(fault.value);
  }
  CHECK(values.size() > 10);
}
