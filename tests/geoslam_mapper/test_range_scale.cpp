#include "services/geoslam_mapper/smoothing/range_scale.hpp"

#include <random>

#include "common/geometry/se2.hpp"
#include "tests/catch.hpp"

using namespace understory;
using geoslam_mapper::smoothing::LocatedKeyframe;
using geoslam_mapper::smoothing::RangeScale;

namespace {

/// A drive whose landmarks measure (1 + range_error) times the distances.
struct ScaledDrive {
  std::mt19937_64 random;
  double range_error = 0.0;
  double odometry_error = 0.0;
  double noise_share = 0.01;
  double landmark_sigma_m = 0.01;

  void run(RangeScale& scale, int steps) {
    std::normal_distribution<double> normal;
    geometry::SE2 map_T_vehicle;
    for (int i = 0; i <= steps; ++i) {
      const geometry::SE2 step(2.0, 0.0, 0.02 * normal(random));
      geometry::SE2WithCovariance odometry;
      const double sigma = 2.0 * noise_share;
      const Eigen::Vector2d noise(sigma * normal(random), sigma * normal(random));
      odometry.mean =
          geometry::SE2((1.0 + odometry_error) * step.translation() + noise, step.theta());
      odometry.covariance = Eigen::Vector3d(sigma * sigma, sigma * sigma, 1e-6).asDiagonal();

      map_T_vehicle =
          map_T_vehicle * geometry::SE2((1.0 + range_error) * step.translation(), step.theta());
      LocatedKeyframe located;
      located.utime = i;
      located.map_T_vehicle =
          geometry::SE2(map_T_vehicle.translation() +
                            landmark_sigma_m * Eigen::Vector2d(normal(random), normal(random)),
                        map_T_vehicle.theta());
      located.variance_m2 = landmark_sigma_m * landmark_sigma_m;
      scale.add(located, i > 0 ? std::optional(odometry) : std::nullopt);
    }
  }
};

}  // namespace

TEST_CASE("Odometry tells the scale of ranges as well as is stated", "[range scale]") {
  double squares = 0.0;
  double errors = 0.0;
  constexpr int kDrives = 200;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    std::mt19937_64 random(seed);
    ScaledDrive drive{random};
    drive.range_error = 0.002 * std::normal_distribution<double>()(drive.random);
    RangeScale scale(0.002, 0.0);
    drive.run(scale, 300);
    const double error = scale.map_factor() * (1.0 + drive.range_error) - 1.0;
    squares += error * error / (scale.sigma() * scale.sigma()) / kDrives;
    errors += error / kDrives;
  }
  // Landmarks' noise is counted at both ends of a step, and telescopes: stated too wide, not too
  // narrow.
  CHECK(squares > 0.4);
  CHECK(squares < 1.2);
  CHECK(std::abs(errors) < 1.5e-4);
}

TEST_CASE("What odometry may be off by is not put on the ranges", "[range scale]") {
  ScaledDrive drive{std::mt19937_64(3)};
  drive.odometry_error = 0.01;
  RangeScale scale(0.001, 0.01);
  drive.run(scale, 500);
  CHECK(scale.odometry_factor() == Approx(1.0 / 1.01).margin(1e-3));
  CHECK(std::abs(scale.map_factor() - 1.0) < 3e-4);
  CHECK(scale.sigma() > 0.9e-3);
}

TEST_CASE("Nothing is estimated in a given map, without a prior, or without odometry",
          "[range scale]") {
  ScaledDrive drive{std::mt19937_64(4)};
  drive.range_error = 0.003;
  RangeScale none(0.0, 0.0);
  drive.run(none, 100);
  CHECK(none.map_factor() == 1.0);
  CHECK(none.odometry_factor() == 1.0);
  CHECK(none.sigma() == 0.0);

  RangeScale held(0.002, 0.0);
  held.hold();
  drive.run(held, 100);
  CHECK(held.map_factor() == 1.0);
  CHECK(held.odometry_factor() == 1.0);

  RangeScale alone(0.002, 0.0);
  alone.add({1, {}, 1e-4}, std::nullopt);
  alone.add({2, geometry::SE2(2.0, 0.0, 0.0), 1e-4}, std::nullopt);
  CHECK(alone.map_factor() == 1.0);
  CHECK(alone.sigma() == 0.002);
}

TEST_CASE("A motion that contradicts odometry does not count", "[range scale]") {
  ScaledDrive drive{std::mt19937_64(5)};
  RangeScale scale(0.002, 0.0);
  drive.run(scale, 300);
  const double before = scale.map_factor();
  LocatedKeyframe slipped = *scale.last();
  slipped.map_T_vehicle = slipped.map_T_vehicle * geometry::SE2(4.0, 0.0, 0.0);
  geometry::SE2WithCovariance odometry{geometry::SE2(2.0, 0.0, 0.0),
                                       1e-4 * Eigen::Matrix3d::Identity()};
  scale.add(slipped, odometry);
  CHECK(scale.map_factor() == before);
}
