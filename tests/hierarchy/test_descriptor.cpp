#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "common/geometry/se2.hpp"
#include "common/hierarchy/descriptor_index.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::hierarchy;

namespace {

using Walk = std::vector<Eigen::Vector2d>;

/// A polygon around a centre, of the size that they have in a forest.
Walk random_polygon(std::mt19937_64& random) {
  std::uniform_int_distribution<int> sides(3, 12);
  std::uniform_real_distribution<double> radius(3.0, 15.0);
  std::uniform_real_distribution<double> jitter(0.0, 0.9);
  const int n = sides(random);
  Walk walk;
  for (int i = 0; i < n; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + jitter(random)) / n;
    const double r = radius(random);
    walk.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return walk;
}

/// The thesis' method with many samples: what the integral is the limit of.
Descriptor sampled(const Walk& walk, int samples, int fine) {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  std::vector<double> until{0.0};
  for (std::size_t i = 0; i < walk.size(); ++i) {
    centroid += walk[i] / static_cast<double>(walk.size());
    until.push_back(until.back() + (walk[(i + 1) % walk.size()] - walk[i]).norm());
  }

  std::vector<double> radii;
  std::size_t edge = 0;
  for (int i = 0; i < fine; ++i) {
    const double s = until.back() * (i + 0.5) / fine;
    while (s > until[edge + 1]) {
      ++edge;
    }
    const double part = (s - until[edge]) / (until[edge + 1] - until[edge]);
    const Eigen::Vector2d p =
        walk[edge] + part * (walk[(edge + 1) % walk.size()] - walk[edge]) - centroid;
    radii.push_back(p.norm());
  }

  Descriptor result{};
  for (int k = 0; k <= samples / 2; ++k) {
    std::complex<double> sum = 0.0;
    for (int i = 0; i < fine; ++i) {
      sum += radii[i] * std::polar(1.0, -2.0 * std::numbers::pi * k * i / fine);
    }
    result[k] = static_cast<float>(std::abs(sum) / fine * samples * (k == 0 ? 1.0 : std::sqrt(2)));
  }

  return result;
}

}  // namespace

TEST_CASE("A descriptor does not depend on pose, start, direction or handedness", "[hierarchy]") {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> any(-3.0, 3.0);
  for (int trial = 0; trial < 300; ++trial) {
    const Walk walk = random_polygon(random);
    const Descriptor reference = describe(walk, 20);

    Walk moved = walk;
    const geometry::SE2 motion(1000.0 * any(random), 1000.0 * any(random), any(random));
    std::transform(walk.begin(), walk.end(), moved.begin(),
                   [&](const Eigen::Vector2d& p) { return motion * p; });
    REQUIRE(distance(reference, describe(moved, 20)) < 1.5e-4F);

    Walk turned = walk;
    for (std::size_t start = 1; start < walk.size(); ++start) {
      std::rotate(turned.begin(), turned.begin() + 1, turned.end());
      REQUIRE(distance(reference, describe(turned, 20)) < 1.5e-4F);
    }
    std::reverse(turned.begin(), turned.end());
    REQUIRE(distance(reference, describe(turned, 20)) < 1.5e-4F);
    for (Eigen::Vector2d& p : turned) {
      p.x() = -p.x();
    }
    REQUIRE(distance(reference, describe(turned, 20)) < 1.5e-4F);
  }
}

TEST_CASE("A descriptor is the limit of finer and finer sampling", "[hierarchy]") {
  std::mt19937_64 random(22);
  for (const int samples : {4, 10, 20, 30}) {
    std::vector<float> errors;
    for (int trial = 0; trial < 50; ++trial) {
      const Walk walk = random_polygon(random);
      errors.push_back(distance(describe(walk, samples), sampled(walk, samples, 4000)));
    }
    std::sort(errors.begin(), errors.end());
    REQUIRE(errors[25] < 2e-4F);
    // An edge close by the centroid puts a kink into the distance.
    REQUIRE(errors.back() < 0.03F);
  }
}

TEST_CASE("Bin 0 is the mean distance, so tau has the thesis' meaning", "[hierarchy]") {
  const Walk square{{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}};
  // Mean of sqrt(1 + x^2) over [0, 1].
  const double mean = 0.5 * (std::sqrt(2.0) + std::asinh(1.0));
  REQUIRE(describe(square, 20)[0] == Approx(20.0 * mean).epsilon(1e-5));
  // Four-fold symmetry leaves bins 4 and 8.
  const Descriptor descriptor = describe(square, 20);
  for (const std::size_t bin : {1U, 2U, 3U, 5U, 6U, 7U, 9U, 10U}) {
    REQUIRE(descriptor[bin] == Approx(0.0).margin(1e-3));
  }
  REQUIRE(descriptor[4] > 1.0F);
}

TEST_CASE("A descriptor moves no more than its polygon", "[hierarchy]") {
  // 20 samples, each radius changed by at most twice the noise: 2 sqrt(20) sqrt(20) noise bounds
  // it.
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> noise(-0.01, 0.01);
  for (int trial = 0; trial < 300; ++trial) {
    Walk walk = random_polygon(random);
    const Descriptor before = describe(walk, 20);
    for (Eigen::Vector2d& p : walk) {
      p += Eigen::Vector2d(noise(random), noise(random));
    }
    REQUIRE(distance(before, describe(walk, 20)) < 0.35F);
  }
}

TEST_CASE("Steps that have no descriptor are refused", "[hierarchy]") {
  REQUIRE(sample_count(0.05) == 20);
  REQUIRE(sample_count(1.0 / 30.0) == 30);
  REQUIRE_THROWS_AS(sample_count(0.01), std::invalid_argument);
  REQUIRE_THROWS_AS(sample_count(0.5), std::invalid_argument);
}

TEST_CASE("The index finds what a search through everything finds", "[hierarchy]") {
  std::mt19937_64 random(24);
  std::vector<Descriptor> descriptors;
  std::vector<bool> present;
  DescriptorIndex index(2.0F);
  std::vector<DescriptorIndex::Hit> hits;
  std::size_t found_in_all = 0;

  for (int step = 0; step < 4000; ++step) {
    if (random() % 3 != 0 || descriptors.empty()) {
      descriptors.push_back(describe(random_polygon(random), 20));
      present.push_back(true);
      index.insert(static_cast<std::uint32_t>(descriptors.size() - 1), descriptors.back());
    } else {
      const std::size_t key = random() % descriptors.size();
      REQUIRE(index.erase(static_cast<std::uint32_t>(key), descriptors[key]) == present[key]);
      present[key] = false;
    }

    if (step % 10 != 0) {
      continue;
    }

    const Descriptor query = step % 20 == 0 ? describe(random_polygon(random), 20)
                                            : descriptors[random() % descriptors.size()];
    for (const float radius : {0.0F, 2.0F, 7.5F, 40.0F, 1000.0F}) {
      index.within(query, radius, hits);
      std::size_t expected = 0;
      for (std::size_t key = 0; key < descriptors.size(); ++key) {
        expected += present[key] && distance(query, descriptors[key]) <= radius ? 1 : 0;
      }

      REQUIRE(hits.size() == expected);
      found_in_all += hits.size();
      for (std::size_t i = 0; i < hits.size(); ++i) {
        REQUIRE(present[hits[i].key]);
        REQUIRE(hits[i].distance == distance(query, descriptors[hits[i].key]));
        REQUIRE((i == 0 || hits[i - 1].distance <= hits[i].distance));
      }
    }
  }

  REQUIRE(index.size() ==
          static_cast<std::size_t>(std::count(present.begin(), present.end(), true)));
  REQUIRE(found_in_all > 10000);
}
