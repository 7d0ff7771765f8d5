// Scenes where points have several landmarks near them: the pose settles, and is found at all.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "common/constellation/map.hpp"
#include "common/constellation/mixture.hpp"
#include "common/constellation/settle.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::constellation;

namespace {

using Stems = std::vector<Eigen::Vector2d>;

/// Anywhere, as near to each other as it comes.
Stems scattered(std::mt19937_64& random, double side_m, double per_m2) {
  std::uniform_real_distribution<double> place(0.0, side_m);
  Stems stems(static_cast<std::size_t>(per_m2 * side_m * side_m));
  for (Eigen::Vector2d& stem : stems) {
    const double x = place(random);
    stem = {x, place(random)};
  }
  return stems;
}

/// Half of the stems in clumps of about 12 within metres, as young trees grow in a gap.
Stems clumped(std::mt19937_64& random, double side_m, double per_m2) {
  Stems stems = scattered(random, side_m, 0.5 * per_m2);
  std::normal_distribution<double> around(0.0, 2.5);
  for (const Eigen::Vector2d& centre : scattered(random, side_m, 0.5 * per_m2 / 12.0)) {
    for (int i = 0; i < 12; ++i) {
      const double x = around(random);
      stems.push_back(centre + Eigen::Vector2d(x, around(random)));
    }
  }
  return stems;
}

ConstellationMap constellation_of(const Stems& stems) {
  ConstellationMap map;
  for (std::size_t i = 0; i < stems.size(); ++i) map.insert(i + 1, stems[i]);
  return map;
}

std::vector<ObservedPoint> seen_from(const Stems& stems, const geometry::SE2& map_T_sensor,
                                     double range_m, double sigma_m, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, sigma_m);
  std::vector<ObservedPoint> points;
  for (const Eigen::Vector2d& stem : stems) {
    const Eigen::Vector2d point = map_T_sensor.inverse() * stem;
    if (point.norm() > range_m || unit(random) > 0.9) continue;
    const double x = noise(random);
    points.push_back({point + Eigen::Vector2d(x, noise(random)), sigma_m});
  }
  return points;
}

geometry::SE2 somewhere(std::mt19937_64& random, double low_m, double high_m) {
  std::uniform_real_distribution<double> place(low_m, high_m);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  const double x = place(random);
  const double y = place(random);
  return {x, y, angle(random)};
}

double nees_of(const geometry::SE2& estimate, const Eigen::Matrix3d& covariance,
               const geometry::SE2& truth) {
  const Eigen::Vector3d error = (estimate.inverse() * truth).Log();
  return error.dot(covariance.ldlt().solve(error));
}

}  // namespace

TEST_CASE("In clumps no pose is stuck beside the right one", "[constellation]") {
  double sum = 0.0;
  int found = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    std::mt19937_64 random(seed);
    const Stems stems = clumped(random, 200.0, 0.03);
    const ConstellationMap map = constellation_of(stems);
    for (int i = 0; i < 400; ++i) {
      const geometry::SE2 truth = somewhere(random, 10.0, 190.0);
      const Localisation result = map.localise(seen_from(stems, truth, 40.0, 0.2, random));
      if (!result.found()) continue;
      const double nees = nees_of(result.map_T_sensor, result.covariance, truth);
      CAPTURE(seed, i, result.inliers);
      // One in 10 million if the covariance is right; stuck ones had 200 to 1,700.
      REQUIRE(nees < 35.0);
      sum += nees;
      ++found;
    }
  }
  CAPTURE(found, sum / found);
  CHECK(found >= 1190);
  CHECK(sum / found > 2.7);
  CHECK(sum / found < 3.3);
}

TEST_CASE("A pose settles from metres away, and says what it knows", "[constellation]") {
  std::mt19937_64 random(4);
  const Stems stems = clumped(random, 120.0, 0.05);
  const ConstellationMap map = constellation_of(stems);
  const LocaliseParameters parameters;
  std::normal_distribution<double> unit(0.0, 1.0);
  double sum = 0.0;
  int stuck_before = 0;
  const int n = 200;

  for (int i = 0; i < n; ++i) {
    const geometry::SE2 truth = somewhere(random, 40.0, 80.0);
    const auto prepared = prepare(seen_from(stems, truth, 40.0, 0.2, random), parameters);
    // Every point paired with what is nearest to it from a pose about a metre off.
    const double x = 0.7 * unit(random);
    const double y = 0.7 * unit(random);
    const geometry::SE2 off = truth * geometry::SE2(x, y, 0.02 * unit(random));
    std::vector<Pair> pairs;
    for (std::uint32_t k = 0; k < prepared.points.size(); ++k) {
      const Eigen::Vector2d mapped = off * prepared.points[k].position;
      Pair pair{k, kNoSlot, 0.0};
      pair.slot = nearest_slot(map.grid(), mapped.x(), mapped.y(), 0.7, pair.squared_m2);
      if (pair.slot != kNoSlot) pairs.push_back(pair);
    }
    FittedPose start;
    start.map_T_sensor = off;
    start.pairs = pairs;
    const auto settled = settle(prepared, map.grid(), start, parameters);
    REQUIRE(settled);
    const double nees = nees_of(settled->pose.map_T_sensor, settled->covariance, truth);
    CAPTURE(i, x, y);
    REQUIRE(nees < 35.0);
    sum += nees / n;

    const FittedPose fitted = fit_pose(prepared, map.grid(), pairs, parameters);
    stuck_before += (fitted.map_T_sensor.translation() - truth.translation()).norm() > 0.2 ? 1 : 0;
  }
  CAPTURE(sum, stuck_before);
  CHECK(sum > 2.4);
  CHECK(sum < 3.6);
  CHECK(stuck_before > 5);  // Else this test shows nothing.
}

TEST_CASE("Gradient and information of the mixture are those of its likelihood",
          "[constellation]") {
  std::mt19937_64 random(5);
  const Stems stems = scattered(random, 60.0, 0.2);
  const ConstellationMap map = constellation_of(stems);
  const Mixture mixture{0.9, 0.2};
  const double step = 1e-3;

  for (int i = 0; i < 20; ++i) {
    const geometry::SE2 truth = somewhere(random, 25.0, 35.0);
    const auto prepared = prepare(seen_from(stems, truth, 15.0, 0.2, random), {});
    const auto mode = climb(prepared, map.grid(), truth, mixture, {});
    const auto at = [&](const Eigen::Vector3d& xi) {
      return evaluate(prepared, map.grid(), mode.map_T_sensor * geometry::SE2::Exp(xi), mixture);
    };
    const Eigen::Vector3d away(0.02, -0.01, 0.001);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d along = step * Eigen::Vector3d::Unit(k);
      // The slope, anywhere. Landmarks at the rim of the reach come
      // and go, each with a hundredth.
      const double slope =
          (at(away + along).log_likelihood - at(away - along).log_likelihood) / (2.0 * step);
      const Eigen::Vector3d gradient = at(away).gradient;
      CHECK(gradient[k] == Approx(slope).margin(6.0 + 0.02 * gradient.norm()));
      // The curvature, at the maximum.
      const Eigen::Vector3d change = (at(along).gradient - at(-along).gradient) / (2.0 * step);
      const Eigen::Vector3d column = mode.at.information().col(k);
      CHECK((change + column).norm() < 0.03 * column.norm());
    }
  }
}

TEST_CASE("Stems closer together than they are seen exactly have a place all the same",
          "[constellation]") {
  std::mt19937_64 random(6);
  const Stems stems = scattered(random, 150.0, 0.3);
  const ConstellationMap map = constellation_of(stems);
  int found = 0;
  for (int i = 0; i < 150; ++i) {
    const geometry::SE2 truth = somewhere(random, 30.0, 120.0);
    const Localisation result = map.localise(seen_from(stems, truth, 25.0, 0.2, random));
    REQUIRE(result.outcome != LocaliseOutcome::kNoMatch);
    if (!result.found()) continue;
    ++found;
    REQUIRE(nees_of(result.map_T_sensor, result.covariance, truth) < 35.0);
  }
  CAPTURE(found);
  CHECK(found >= 148);
}

TEST_CASE("A search ends after the work that it is allowed, and says so", "[constellation]") {
  std::mt19937_64 random(7);
  const ConstellationMap map = constellation_of(scattered(random, 150.0, 0.3));
  const Stems other = scattered(random, 150.0, 0.3);
  for (const std::uint32_t allowed : {1000U, 10000U, 100000U}) {
    LocaliseParameters parameters;
    parameters.max_lookups = allowed;
    for (int i = 0; i < 10; ++i) {
      const auto points = seen_from(other, somewhere(random, 30.0, 120.0), 25.0, 0.2, random);
      const Localisation result = map.localise(points, parameters);
      REQUIRE(result.outcome == LocaliseOutcome::kGaveUp);
      // One hypothesis more at most, with its fit in ten rounds.
      REQUIRE(result.lookups < allowed + 20 + 10 * points.size());
    }
  }
}

TEST_CASE("Hermits are those that stand alone in a crowd, however the map came about",
          "[constellation]") {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> place(0.0, 40.0);
  ConstellationMap map;
  std::map<LandmarkId, Eigen::Vector2d> model;
  for (int change = 0; change < 3000; ++change) {
    const LandmarkId id = 1 + random() % 600;
    const double x = std::round(8.0 * place(random)) / 8.0;  // Many at exactly equal distances.
    const Eigen::Vector2d position(x, std::round(8.0 * place(random)) / 8.0);
    if (model.count(id) == 0) {
      map.insert(id, position);
      model[id] = position;
    } else if (random() % 3 == 0) {
      map.remove(id);
      model.erase(id);
    } else {
      map.move(id, position);
      model[id] = position;
    }
  }

  ConstellationMap anew;
  for (const auto& [id, position] : model) anew.insert(id, position);
  const auto ids_of = [](const ConstellationMap& of, const Hermits& hermits) {
    std::set<std::set<LandmarkId>> triangles;
    for (const auto& slots : hermits.triangles().all())
      triangles.insert({of.id_of(slots[0]), of.id_of(slots[1]), of.id_of(slots[2])});
    return triangles;
  };
  for (std::size_t level = 0; level < map.hermits().size(); ++level) {
    const Hermits& hermits = map.hermits()[level];
    const auto triangles = ids_of(map, hermits);
    REQUIRE(triangles == ids_of(anew, anew.hermits()[level]));

    std::set<LandmarkId> corners;
    for (const auto& triangle : triangles) corners.insert(triangle.begin(), triangle.end());
    std::set<LandmarkId> alone;
    const double reach_m = Hermits::kAround * hermits.apart_m();
    for (const auto& [id, position] : model) {
      std::uint32_t around = 0;
      bool has_near = false;
      for (const auto& [other, at] : model) {
        const double squared = (at - position).squaredNorm();
        if (other == id || squared > reach_m * reach_m) continue;
        ++around;
        has_near = has_near || squared < hermits.apart_m() * hermits.apart_m();
      }
      if (!has_near && around >= Hermits::kCrowd) alone.insert(id);
    }
    CAPTURE(level, alone.size());
    if (alone.size() >= 3) REQUIRE(corners == alone);
    if (alone.size() < 3) REQUIRE(corners.empty());
  }
}
