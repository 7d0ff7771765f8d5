#include <algorithm>
#include <cmath>
#include <set>

#include "eval/baselines/hierarchy/matching.hpp"
#include "eval/baselines/hierarchy/similarity.hpp"
#include "tests/baseline/clouds.hpp"
#include "tests/catch.hpp"

#include <Eigen/QR>

namespace understory::test {
namespace {

using test::moved;
using test::random_cloud;

std::vector<Eigen::Vector2d> noisy_part(const std::vector<Eigen::Vector2d>& cloud,
                                        double probability, double sigma_m,
                                        std::mt19937_64& random) {
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, sigma_m);
  std::vector<Eigen::Vector2d> part;
  for (const Eigen::Vector2d& point : cloud) {
    if (chance(random) < probability) {
      const double dx = noise(random);
      part.emplace_back(point + Eigen::Vector2d(dx, noise(random)));
    }
  }
  return part;
}

/// Polygons that are each other's nearest below tau, by trying all pairs.
std::set<std::pair<std::uint32_t, std::uint32_t>> mutual_nearest(
    const eval::baselines::hierarchy::Hierarchy& a, const eval::baselines::hierarchy::Hierarchy& b,
    double tau, int sides) {
  const auto nearest = [&](const eval::baselines::hierarchy::Polygon& polygon,
                           const eval::baselines::hierarchy::Hierarchy& others) {
    std::uint32_t best = 0;
    double least = tau;
    bool found = false;
    for (std::uint32_t i = 0; i < others.polygons().size(); ++i) {
      const eval::baselines::hierarchy::Polygon& other = others.polygons()[i];
      const auto difference =
          static_cast<int>(other.vertices.size()) - static_cast<int>(polygon.vertices.size());
      const double distance = (other.descriptor - polygon.descriptor).norm();
      if (std::abs(difference) <= sides && distance < least) {
        least = distance;
        best = i;
        found = true;
      }
    }
    return std::pair(found, best);
  };
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i < a.polygons().size(); ++i) {
    const auto [found, there] = nearest(a.polygons()[i], b);
    if (found && nearest(b.polygons()[there], a) == std::pair(true, i)) {
      pairs.emplace(i, there);
    }
  }
  return pairs;
}

TEST_CASE("A cloud matches itself, each landmark with itself") {
  std::mt19937_64 random(1);
  const auto cloud = test::random_cloud(60, 70.0, random);
  const eval::baselines::hierarchy::Hierarchy hierarchy(cloud, 0.05);
  const auto pairs = match_hierarchies(hierarchy, hierarchy, {});
  CHECK(pairs.size() == cloud.size());
  for (const eval::baselines::hierarchy::PointMatch& pair : pairs) {
    CHECK(pair.local == pair.other);
  }
}

TEST_CASE("A rotated cloud matches itself") {
  std::mt19937_64 random(2);
  const auto cloud = test::random_cloud(60, 70.0, random);
  const auto rotated = test::moved(cloud, geometry::SE2(30.0, -4.0, 1.9));
  const auto pairs = match_hierarchies(eval::baselines::hierarchy::Hierarchy(cloud, 0.05),
                                       eval::baselines::hierarchy::Hierarchy(rotated, 0.05), {});
  const auto right = std::count_if(
      pairs.begin(), pairs.end(),
      [](const eval::baselines::hierarchy::PointMatch& pair) { return pair.local == pair.other; });
  CHECK(pairs.size() >= 40);
  CHECK(static_cast<double>(right) >= 0.9 * static_cast<double>(pairs.size()));
}

TEST_CASE("The search along the mean radius finds what trying all pairs finds") {
  std::mt19937_64 random(3);
  for (int round = 0; round < 20; ++round) {
    const auto cloud = test::random_cloud(150, 110.0, random);
    const eval::baselines::hierarchy::Hierarchy a(noisy_part(cloud, 0.9, 0.2, random), 0.05);
    const eval::baselines::hierarchy::Hierarchy b(noisy_part(cloud, 0.9, 0.2, random), 0.05);
    const eval::baselines::hierarchy::MatchingParameters parameters{6.0, 3, 0.5};
    const eval::baselines::hierarchy::HierarchyMatches matches(a, b, parameters);
    std::set<std::pair<std::uint32_t, std::uint32_t>> found;
    for (const auto& [local, other] : matches.polygons()) {
      found.emplace(local, other);
    }
    CHECK(found == mutual_nearest(a, b, 6.0, 3));
  }
}

TEST_CASE("One search serves every smaller threshold") {
  std::mt19937_64 random(4);
  const auto cloud = test::random_cloud(150, 110.0, random);
  const eval::baselines::hierarchy::Hierarchy a(noisy_part(cloud, 0.9, 0.1, random), 0.05);
  const eval::baselines::hierarchy::Hierarchy b(noisy_part(cloud, 0.9, 0.1, random), 0.05);
  const eval::baselines::hierarchy::HierarchyMatches wide(a, b, {10.0, 3, 0.5});
  for (const double tau : {1.0, 2.0, 3.5, 5.0, 10.0}) {
    const auto once = wide.points(tau);
    const auto again = match_hierarchies(a, b, {tau, 3, 0.5});
    REQUIRE(once.size() == again.size());
    for (std::size_t i = 0; i < once.size(); ++i) {
      CHECK(once[i].local == again[i].local);
      CHECK(once[i].other == again[i].other);
    }
  }
}

TEST_CASE("A similarity is the least-squares solution of the linear problem") {
  std::mt19937_64 random(5);
  for (int round = 0; round < 50; ++round) {
    const auto from = test::random_cloud(6, 40.0, random);
    const auto to =
        noisy_part(test::moved(from, geometry::SE2(3.0, 1.0, 0.4 * round)), 2.0, 0.3, random);
    Eigen::MatrixXd a(12, 4);
    Eigen::VectorXd b(12);
    for (Eigen::Index i = 0; i < 6; ++i) {
      const Eigen::Vector2d& p = from[static_cast<std::size_t>(i)];
      a.row(2 * i) << p.x(), -p.y(), 1.0, 0.0;
      a.row(2 * i + 1) << p.y(), p.x(), 0.0, 1.0;
      b.segment<2>(2 * i) = to[static_cast<std::size_t>(i)];
    }
    const Eigen::Vector4d expected = a.colPivHouseholderQr().solve(b);
    const auto fit = eval::baselines::hierarchy::fit_similarity(from, to);
    REQUIRE(fit);
    const Eigen::Vector4d found(fit->cosine, fit->sine, fit->translation_m.x(),
                                fit->translation_m.y());
    CHECK((found - expected).norm() < 1e-9);
  }
}

TEST_CASE("Coinciding points have no similarity") {
  const std::vector<Eigen::Vector2d> same(3, Eigen::Vector2d(1.0, 2.0));
  CHECK_FALSE(eval::baselines::hierarchy::fit_similarity(same, same));
}

}  // namespace
}  // namespace understory::test
