// The rotation of the sensor, found in the points of a sweep.
#include <cmath>
#include <random>

#include "services/landmark_extractor/points/spin_fit.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::landmark_extractor::points;

namespace {

/// One revolution among walls at random ranges; the sensor moves evenly.
model::PointSweep revolution(double rate_radps, const Eigen::Vector2d& velocity_mps,
                             std::mt19937_64& random) {
  constexpr int kPoints = 1500;
  std::uniform_real_distribution<float> range(4.0F, 30.0F);
  model::PointSweep sweep;
  sweep.rings = 2;
  sweep.has_times = true;
  const double turn_s = 2.0 * M_PI / std::abs(rate_radps);
  for (int i = 0; i < kPoints; ++i) {
    const double time_s = turn_s * i / kPoints;
    const double azimuth = -3.0 + rate_radps * time_s;
    for (std::uint16_t ring = 0; ring < 2; ++ring) {
      model::SweepPoint point;
      const float far = range(random);
      point.x_m = far * static_cast<float>(std::cos(azimuth)) +
                  static_cast<float>(velocity_mps.x() * time_s);
      point.y_m = far * static_cast<float>(std::sin(azimuth)) +
                  static_cast<float>(velocity_mps.y() * time_s);
      point.time_s = static_cast<float>(time_s);
      point.ring = ring;
      sweep.points.push_back(point);
    }
  }
  return sweep;
}

}  // namespace

TEST_CASE("The spin of a sweep is found, whatever sweep came before", "[extractor]") {
  std::mt19937_64 random(3);
  SpinFitter kept;
  for (const double rate_radps : {62.8, -62.8, 31.4, 125.6, -31.4, 31.4, -125.6}) {
    const Eigen::Vector2d velocity_mps(8.0, -3.0);
    const model::PointSweep sweep = revolution(rate_radps, velocity_mps, random);
    CAPTURE(rate_radps);

    Spin spin;
    kept.fit(sweep, 100.0, spin);
    CHECK(spin.rate_radps == Approx(rate_radps).epsilon(1e-3));
    CHECK((spin.velocity_mps.cast<double>() - velocity_mps).norm() < 0.5);
    CHECK(spin.is_leftward == (rate_radps > 0.0));

    // To the last bit what one finds that saw no sweep before.
    Spin fresh;
    SpinFitter().fit(sweep, 100.0, fresh);
    CHECK(spin.rate_radps == fresh.rate_radps);
    CHECK(spin.velocity_mps == fresh.velocity_mps);
  }
}
