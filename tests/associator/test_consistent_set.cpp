#include <cmath>
#include <random>

#include "services/associator/consistent_set.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

std::vector<ConsistencyPoint> scatter(int count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-15.0, 15.0);
  std::vector<ConsistencyPoint> points;
  for (int i = 0; i < count; ++i) points.push_back({{u(random), u(random)}, 0.0025, 0});
  return points;
}

}  // namespace

TEST_CASE("The consistent set finds a motion that the guess missed by far", "[associator]") {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const auto reference = scatter(25, random);
    const geometry::SE2 truth(1.0 * normal(random), 1.0 * normal(random), 0.15 * normal(random));
    std::vector<ConsistencyPoint> observed;
    std::vector<std::uint32_t> origin;
    for (std::uint32_t i = 0; i < 25; i += 2) {
      ConsistencyPoint point = reference[i];
      point.position_m = truth.inverse() * point.position_m +
                         0.05 * Eigen::Vector2d(normal(random), normal(random));
      observed.push_back(point);
      origin.push_back(i);
    }
    for (const ConsistencyPoint& clutter : scatter(4, random)) observed.push_back(clutter);
    const auto pairs =
        consistent_set(reference, observed, geometry::SE2(), {4.0, 4.0, 0.5, 200000});
    std::size_t right = 0;
    for (const ConsistencyPair& pair : pairs) {
      if (pair.observed < origin.size() && origin[pair.observed] == pair.reference) ++right;
    }
    REQUIRE(right >= origin.size() - 2);
    REQUIRE(pairs.size() <= right + 3);
  }
}

TEST_CASE("The consistent set is the largest clique, as brute force finds it", "[associator]") {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 30; ++trial) {
    const auto reference = scatter(4, random);
    auto observed = scatter(2, random);
    observed.push_back(reference[0]);
    observed.push_back(reference[1]);
    const ConsistencyGate gate{4.0, 100.0, 0.0, 200000};
    const auto pairs = consistent_set(reference, observed, geometry::SE2(), gate);
    std::size_t best = 0;
    for (int code = 0; code < 625; ++code) {
      std::vector<ConsistencyPair> chosen;
      bool fits = true;
      for (std::uint32_t o = 0, rest = static_cast<std::uint32_t>(code); o < 4; ++o, rest /= 5) {
        const std::uint32_t r = rest % 5;
        if (r == 4) continue;
        for (const ConsistencyPair& p : chosen) {
          const double difference =
              (reference[r].position_m - reference[p.reference].position_m).norm() -
              (observed[o].position_m - observed[p.observed].position_m).norm();
          fits = fits && r != p.reference && std::abs(difference) <= 4.0 * std::sqrt(4 * 0.0025);
        }
        chosen.push_back({r, o});
      }
      if (fits) best = std::max(best, chosen.size());
    }
    REQUIRE(pairs.size() == best);
  }
}

TEST_CASE("Kinds never mix in a consistent set", "[associator]") {
  std::mt19937_64 random(3);
  auto reference = scatter(10, random);
  auto observed = reference;
  for (ConsistencyPoint& point : observed) point.kind = 1;
  REQUIRE(consistent_set(reference, observed, geometry::SE2(), {4.0, 5.0, 0.1, 1000}).empty());
}
