// Trunks in sweeps of lasers that scan in space: found, with true covariances; nothing else.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <limits>
#include <random>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_space.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::test;

namespace {

/// Parameters that describe the simulated stems: true cones.
LandmarkExtractorParameters exact_stems() {
  LandmarkExtractorParameters parameters;
  parameters.trunk.roundness_sigma_m = 0.0;
  parameters.trunk.out_of_round = 0.0;
  return parameters;
}

test::Space random_wood(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-20.0, 20.0);
  std::uniform_real_distribution<double> radii(0.06, 0.35);
  std::normal_distribution<double> leans(0.0, 0.03);
  test::Space space;
  space.slope = {0.004 * place(random), 0.004 * place(random)};
  while (space.stems.size() < 25) {
    const Eigen::Vector2d at(place(random), place(random));
    const bool is_free = at.norm() > 3.0 && std::all_of(space.stems.begin(), space.stems.end(),
                                                        [&](const test::Stem& s) {
                                                          return (s.breast - at).norm() > 1.5;
                                                        });
    if (is_free) {
      space.stems.push_back({at, radii(random), {leans(random), leans(random)}, 0.01});
    }
  }
  return space;
}

const test::Stem* stem_of(const model::Detection& detection, const test::Space& space) {
  const auto nearest = std::min_element(
      space.stems.begin(), space.stems.end(), [&](const test::Stem& a, const test::Stem& b) {
        return (a.breast - detection.position_m.head<2>()).norm() <
               (b.breast - detection.position_m.head<2>()).norm();
      });
  const bool is_near = nearest != space.stems.end() &&
                       (nearest->breast - detection.position_m.head<2>()).norm() < 0.4;
  return is_near ? &*nearest : nullptr;
}

Eigen::Quaterniond tilt(double roll, double pitch) {
  return Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

}  // namespace

TEST_CASE("trunks of a wood are found by 16, 32 and 64 beams", "[extractor]") {
  for (const int rings : {16, 32, 64}) {
    std::mt19937_64 random(static_cast<std::uint64_t>(rings));
    LandmarkExtractor extractor(exact_stems());
    std::size_t true_ones = 0;
    std::size_t found = 0;
    double square = 0.0;
    double nees = 0.0;
    for (int run = 0; run < 6; ++run) {
      const test::Space space = random_wood(random);
      const model::LandmarkScan scan =
          extractor.extract(sweep(space, test::spinner_of(rings), random, tilt(0.05, -0.03)));
      true_ones += space.stems.size();
      for (const model::Detection& detection : scan.detections) {
        const test::Stem* stem = stem_of(detection, space);
        REQUIRE(stem != nullptr);
        ++found;
        const Eigen::Vector2d error = detection.position_m.head<2>() - stem->breast;
        const Eigen::Matrix2d covariance = detection.covariance_m2.topLeftCorner<2, 2>();
        square += error.squaredNorm();
        nees += error.dot(covariance.inverse() * error);
        CHECK(detection.position_m.z() == Approx(space.ground(stem->breast) + 1.3).margin(0.4));
        CHECK(detection.radius_m == Approx(stem->radius).margin(0.06));
      }
    }
    // Some stand behind others.
    CHECK(found >= 0.85 * static_cast<double>(true_ones));
    CHECK(std::sqrt(square / static_cast<double>(found)) < 0.03);
    // Edges that rings see in one place count as one, which is cautious.
    CHECK(nees / static_cast<double>(found) > 0.8);
    CHECK(nees / static_cast<double>(found) < 3.0);
  }
}

TEST_CASE("stems seem no nearer and no thinner, also where beams are lost", "[extractor]") {
  for (const double drop_out : {0.0, 0.05}) {
    std::mt19937_64 random(5);
    LandmarkExtractor extractor(exact_stems());
    double along = 0.0;
    double thicker = 0.0;
    double found = 0.0;
    for (int run = 0; run < 25; ++run) {
      const test::Space space = random_wood(random);
      test::Spinner spinner = test::spinner_of(32);
      spinner.drop_out = drop_out;
      const model::LandmarkScan scan =
          extractor.extract(sweep(space, spinner, random, tilt(0.0, 0.0)));
      for (const model::Detection& detection : scan.detections) {
        const test::Stem* stem = stem_of(detection, space);
        if (stem == nullptr || stem->breast.norm() < 10.0) continue;
        along += stem->breast.normalized().dot(detection.position_m.head<2>() - stem->breast);
        thicker += detection.radius_m - stem->radius;
        found += 1.0;
      }
    }
    REQUIRE(found > 200.0);
    INFO("beams lost: " << drop_out);
    CHECK(std::abs(along / found) < 0.002);
    CHECK(std::abs(thicker / found) < 0.002);
  }
}

TEST_CASE("the covariance of a lone stem is true, and that of the attitude in it", "[extractor]") {
  constexpr double kTilt = 0.01;
  std::mt19937_64 random(7);
  std::normal_distribution<double> tilts(0.0, kTilt);
  std::uniform_real_distribution<double> ranges(4.0, 18.0);
  std::normal_distribution<double> leans(0.0, 0.05);
  LandmarkExtractorParameters parameters = exact_stems();
  parameters.trunk.prior_lean_sigma_rad = 0.05;  // As drawn.
  LandmarkExtractor extractor(parameters);
  test::Spinner spinner = test::spinner_of(16);
  spinner.sensor.z() = 0.5;  // Trunks are well above the origin's level where they are seen.
  double plan = 0.0;
  double space_nees = 0.0;
  int count = 0;
  for (int run = 0; run < 150; ++run) {
    test::Space space;
    space.stems = {{{ranges(random), -3.0}, 0.2, {leans(random), leans(random)}, 0.01}};
    model::PointSweep turn = sweep(space, spinner, random);
    turn.attitude->level_Q_vehicle = tilt(tilts(random), tilts(random));
    turn.attitude->covariance_rad2 = kTilt * kTilt * Eigen::Matrix2d::Identity();
    const model::LandmarkScan scan = extractor.extract(turn);
    if (scan.detections.size() != 1) continue;
    const model::Detection& seen = scan.detections[0];
    Eigen::Vector3d error = seen.position_m;
    error.head<2>() -= space.stems[0].breast;
    error.z() -= 1.3;
    const Eigen::Matrix2d covariance = seen.covariance_m2.topLeftCorner<2, 2>();
    plan += error.head<2>().dot(covariance.inverse() * error.head<2>());
    space_nees += error.dot(seen.covariance_m2.inverse() * error);
    ++count;
  }
  REQUIRE(count >= 145);
  CHECK(plan / count > 1.4);
  CHECK(plan / count < 2.7);
  CHECK(space_nees / count > 1.4);
  CHECK(space_nees / count < 4.0);
}

TEST_CASE("the motion of the sensor during a revolution is taken out of its lines of sight",
          "[extractor]") {
  // What a sensor at 10 m/s sees: each column of the turn from where it was then.
  std::mt19937_64 random(9);
  const Eigen::Vector2d velocity(10.0, 1.0);
  const test::Space space = random_wood(random);
  const test::Spinner spinner = test::spinner_of(32);
  model::PointSweep moving;
  test::Spinner part = spinner;
  std::mt19937_64 noise(10);
  constexpr int kStops = 64;
  for (int k = 0; k < kStops; ++k) {
    const double middle_s = 0.1 * ((k + 0.5) / kStops - 1.0);
    part.sensor.head<2>() = velocity * middle_s;
    noise.seed(10);  // The turns begin at one azimuth.
    const model::PointSweep still = sweep(space, part, noise);
    if (k == 0) moving = still;
    if (k == 0) moving.points.clear();
    for (const model::SweepPoint& point : still.points) {
      const int stop = static_cast<int>((point.time_s / 0.1 + 1.0) * kStops);
      if (stop == k) moving.points.push_back(point);
    }
  }
  moving.sensor_position_m = spinner.sensor;
  LandmarkExtractor extractor(exact_stems());
  const model::LandmarkScan scan = extractor.extract(moving);
  CHECK(scan.detections.size() >= 20);
  for (const model::Detection& detection : scan.detections) {
    const test::Stem* stem = stem_of(detection, space);
    REQUIRE(stem != nullptr);
    CHECK((detection.position_m.head<2>() - stem->breast).norm() < 0.025);
  }
  landmark_extractor::rings::RingCloud cloud;
  cloud.look_at(moving, 1.0, 30.0);
  CHECK(cloud.velocity_mps().x() == Approx(10.0).margin(0.5));
  CHECK(cloud.velocity_mps().y() == Approx(1.0).margin(0.5));
}

TEST_CASE("people, posts, hanging branches and bushes are no trunks", "[extractor]") {
  std::mt19937_64 random(11);
  LandmarkExtractor extractor(exact_stems());
  for (const int rings : {32, 64}) {
    test::Space space;
    space.stems.push_back({{9.0, 2.0}, 0.22, {0.0, 0.0}, 0.0, 1.75});      // A person.
    space.stems.push_back({{7.0, -6.0}, 0.08, {0.0, 0.0}, 0.0, 1.0});      // A post.
    space.stems.push_back({{-8.0, 3.0}, 0.1, {0.0, 0.0}, 0.0, 9.0, 1.4});  // Hangs in the air.
    space.stems.push_back({{-6.0, -6.0}, 0.015, {0.0, 0.0}, 0.0, 9.0});    // A twig.
    std::normal_distribution<double> spread(0.0, 0.5);
    for (int i = 0; i < 60; ++i) {  // A bush.
      space.stems.push_back({{1.0 + spread(random), 10.0 + spread(random)},
                             0.015,
                             {spread(random), spread(random)},
                             0.0,
                             1.8});
    }
    CHECK(extractor.extract(sweep(space, test::spinner_of(rings), random)).detections.empty());
  }
  CHECK(extractor.sweep_counters().trunks.not_standing >= 4);
}

TEST_CASE("trunks with branches at the height of many beams are found in their place",
          "[extractor]") {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> heights(0.8, 2.0);
  std::uniform_real_distribution<double> bearings(-3.14, 3.14);
  LandmarkExtractor extractor(exact_stems());
  const auto place = [](int k) -> Eigen::Vector2d {
    return (3.0 + k) * Eigen::Vector2d(std::cos(k), std::sin(k));
  };
  for (const int rings : {32, 64}) {
    std::size_t found = 0;
    for (int run = 0; run < 10; ++run) {
      test::Space space;
      for (int k = 0; k < 6; ++k) {
        space.stems.push_back({place(k), 0.13});
        for (int branch = 0; branch < 20; ++branch) {  // Each rises by 36 cm on 36 cm.
          const double bottom = heights(random);
          const double bearing = bearings(random);
          const Eigen::Vector2d lean(std::cos(bearing), std::sin(bearing));
          space.stems.push_back(
              {place(k) + lean * (1.3 - bottom), 0.03, lean, 0.0, bottom + 0.36, bottom});
        }
      }
      const model::LandmarkScan scan =
          extractor.extract(sweep(space, test::spinner_of(rings), random));
      for (int k = 0; k < 6; ++k) {
        const bool is_found = std::ranges::any_of(scan.detections, [&](const model::Detection& d) {
          return (d.position_m.head<2>() - place(k)).norm() < 0.06;
        });
        found += is_found ? 1 : 0;
      }
    }
    CHECK(found >= 50);
  }
}

TEST_CASE("what is measured near the ground alone is a tuft", "[extractor]") {
  std::mt19937_64 random(12);
  LandmarkExtractor extractor(exact_stems());
  for (const int rings : {16, 32, 64}) {
    std::size_t detections = 0;
    for (int run = 0; run < 10; ++run) {
      test::Space space;
      for (int k = 0; k < 6; ++k) {
        const Eigen::Vector2d at =
            (5.0 + 2.0 * k + 0.1 * run) * Eigen::Vector2d(std::cos(k), std::sin(k));
        for (int stalk = 0; stalk < 6; ++stalk) {
          const Eigen::Vector2d aside(std::cos(stalk), std::sin(stalk));
          space.stems.push_back({at + 0.04 * aside, 0.012, {0.0, 0.0}, 0.0, 0.55});
        }
      }
      detections +=
          extractor.extract(sweep(space, test::spinner_of(rings), random)).detections.size();
    }
    CHECK(detections == 0);
  }
}

TEST_CASE("far people are distinguished from trunks by the next beam above them", "[extractor]") {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> ranges(12.0, 24.0);
  LandmarkExtractor extractor(exact_stems());
  for (const int rings : {16, 32}) {
    std::size_t found = 0;
    for (int run = 0; run < 10; ++run) {
      // Houses all around, for the beams that pass above.
      test::Space people;
      const std::array<Eigen::Vector2d, 4> yard{
          Eigen::Vector2d{28.0, 0.0}, {0.0, 28.0}, {-28.0, 0.0}, {0.0, -28.0}};
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d side = 0.5 * (yard[(k + 1) % 4] - yard[(k + 3) % 4]);
        people.facades.push_back({yard[k] - side, yard[k] + side, 15.0});
      }
      test::Space trunks = people;
      for (int k = 0; k < 5; ++k) {
        const double bearing = 1.2 * k;
        const Eigen::Vector2d at =
            ranges(random) * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
        people.stems.push_back({at, 0.22, {0.0, 0.0}, 0.0, 1.75});
        trunks.stems.push_back({at, 0.22});
      }
      const auto count = [&](const test::Space& space) {
        const model::LandmarkScan scan =
            extractor.extract(sweep(space, test::spinner_of(rings), random));
        return static_cast<std::size_t>(std::count_if(
            scan.detections.begin(), scan.detections.end(), [](const model::Detection& d) {
              return d.kind == model::LandmarkKind::kTrunk && d.position_m.head<2>().norm() < 26.0;
            }));
      };
      CHECK(count(people) == 0);
      found += count(trunks);
    }
    CHECK(found >= 48);
  }
}

TEST_CASE("strips of walls are no trunks, posts of signs are", "[extractor]") {
  std::mt19937_64 random(14);
  std::uniform_real_distribution<double> turns(-0.5, 0.5);
  LandmarkExtractor extractor(exact_stems());
  for (const int rings : {16, 32, 64}) {
    std::size_t strips = 0;
    std::size_t posts = 0;
    for (int run = 0; run < 10; ++run) {
      test::Space space;
      test::Space signs;
      for (int k = 0; k < 5; ++k) {
        const double bearing = 1.2 * k;
        const Eigen::Vector2d middle =
            (6.0 + 3.0 * k) * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
        const double across = bearing + 1.57 + turns(random);
        const Eigen::Vector2d half = 0.3 * Eigen::Vector2d(std::cos(across), std::sin(across));
        space.facades.push_back({middle - half, middle + half, 6.0});
        signs.stems.push_back({0.6 * middle, 0.03, {0.0, 0.0}, 0.0, 2.8});
      }
      strips += extractor.extract(sweep(space, test::spinner_of(rings), random)).detections.size();
      posts += extractor.extract(sweep(signs, test::spinner_of(rings), random)).detections.size();
    }
    CHECK(strips <= 2);
    CHECK(posts >= 35);
  }
}

TEST_CASE("sweeps that cannot be give nothing, and bad points are left out", "[extractor]") {
  std::mt19937_64 random(12);
  const test::Space space = random_wood(random);
  const model::PointSweep good = sweep(space, test::spinner_of(32), random);
  LandmarkExtractor extractor;
  const std::size_t seen = extractor.extract(good).detections.size();
  REQUIRE(seen >= 15);
  model::PointSweep bad = good;
  bad.is_deskewed = false;
  CHECK(extractor.extract(bad).detections.empty());
  bad = good;
  bad.rings = 0;
  CHECK(extractor.extract(bad).detections.empty());
  bad = good;
  bad.attitude->level_Q_vehicle.coeffs().setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK(extractor.extract(bad).detections.empty());
  CHECK(extractor.sweep_counters().malformed == 3);
  bad = good;
  bad.points.clear();
  CHECK(extractor.extract(bad).detections.empty());
  bad = good;
  for (model::SweepPoint& point : bad.points) point.x_m = std::numeric_limits<float>::quiet_NaN();
  CHECK(extractor.extract(bad).detections.empty());
  CHECK(extractor.sweep_counters().points.not_finite == good.points.size());
  bad = good;
  for (std::size_t i = 0; i < bad.points.size(); i += 50) {
    bad.points[i].z_m = std::numeric_limits<float>::infinity();
    bad.points[i].ring = 99;
  }
  const std::size_t still_seen = extractor.extract(bad).detections.size();
  CHECK(still_seen + 3 >= seen);
  bad = good;
  bad.attitude.reset();
  CHECK(extractor.extract(bad).detections.size() + 3 >= seen);
  CHECK(extractor.sweep_counters().without_attitude == 1);
}
