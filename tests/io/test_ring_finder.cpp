// Rings of clouds that do not say them, against the rings with which they were made.
#include <algorithm>
#include <numeric>
#include <random>

#include "common/io/kitti_raw.hpp"
#include "common/io/ring_finder.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::test;

namespace {

using Random = std::mt19937_64;

struct Laser {
  std::vector<double> elevations_rad;
  double offset_up_m = 0.0;        ///< Where the beams leave, above the origin.
  double offset_outwards_m = 0.0;  ///< And from the axis.
};

struct Seen {
  std::vector<Eigen::Vector3f> points_m;
  std::vector<std::uint16_t> rings;
};

/// A revolution in order of firing; some beams have no return.
Seen revolution_of(Random& random, const Laser& laser, std::size_t firings,
                   double begin_rad = 0.0) {
  Seen seen;
  std::uniform_real_distribution<double> range_m(9.0, 60.0);
  std::normal_distribution<double> pointing_rad(0.0, 2e-5);
  for (std::size_t f = 0; f < firings; ++f) {
    const double azimuth =
        begin_rad - 2.0 * M_PI * (static_cast<double>(f) + 0.5) / static_cast<double>(firings);
    for (std::size_t ring = 0; ring < laser.elevations_rad.size(); ++ring) {
      if (random() % 4 == 0) continue;
      const double e = laser.elevations_rad[ring] + pointing_rad(random);
      const double r = range_m(random);
      const double out = laser.offset_outwards_m + r * std::cos(e);
      seen.points_m.push_back(Eigen::Vector3d(out * std::cos(azimuth), out * std::sin(azimuth),
                                              laser.offset_up_m + r * std::sin(e))
                                  .cast<float>());
      seen.rings.push_back(static_cast<std::uint16_t>(ring));
    }
  }
  return seen;
}

Laser even_laser(std::size_t beams, double from_deg, double to_deg) {
  Laser laser;
  for (std::size_t i = 0; i < beams; ++i)
    laser.elevations_rad.push_back(
        (from_deg + (to_deg - from_deg) * static_cast<double>(i) / static_cast<double>(beams - 1)) *
        M_PI / 180.0);
  return laser;
}

}  // namespace

TEST_CASE("rings are found from elevations, in any order of the points", "[io][rings]") {
  Random random(1);
  std::vector<Laser> lasers{even_laser(16, -15, 15), even_laser(32, -25, 15),
                            even_laser(64, -24.8, 2), even_laser(16, -15, 15)};
  lasers.back().offset_up_m = 0.011;
  lasers.back().offset_outwards_m = 0.016;
  for (const Laser& laser : lasers) {
    for (const bool is_shuffled : {false, true}) {
      const Seen seen = revolution_of(random, laser, 900);
      std::vector<std::size_t> order(seen.points_m.size());
      std::iota(order.begin(), order.end(), 0);
      if (is_shuffled) std::shuffle(order.begin(), order.end(), random);
      std::vector<Eigen::Vector3f> points;
      for (const std::size_t i : order) points.push_back(seen.points_m[i]);
      const io::FoundRings found = io::find_rings(points);
      CAPTURE(laser.elevations_rad.size(), is_shuffled, found.from);
      REQUIRE(found.rings == laser.elevations_rad.size());
      CHECK(found.from == "elevations");
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < order.size(); ++i)
        wrong += found.ring[i] == seen.rings[order[i]] ? 0 : 1;
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("rings are found from an order by rings, either way and sense", "[io][rings]") {
  Random random(2);
  // Beams that leave so far from the origin that their elevations overlap.
  Laser laser = even_laser(64, -24.8, 2);
  laser.offset_up_m = 0.21;
  for (const bool is_from_top : {false, true}) {
    for (const bool is_clockwise : {false, true}) {
      const double begin_rad = random() % 2 == 0 ? 0.0 : M_PI;
      const Seen seen = revolution_of(random, laser, 900, begin_rad);
      std::vector<std::size_t> order(seen.points_m.size());
      std::iota(order.begin(), order.end(), 0);
      if (!is_clockwise) std::ranges::reverse(order);
      std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
        return is_from_top ? seen.rings[a] > seen.rings[b] : seen.rings[a] < seen.rings[b];
      });
      std::vector<Eigen::Vector3f> points;
      for (const std::size_t i : order) points.push_back(seen.points_m[i]);
      const io::FoundRings found = io::find_rings(points);
      CAPTURE(is_from_top, is_clockwise, begin_rad, found.from);
      REQUIRE(found.rings == 64);
      CHECK(found.from == "the order of the points");
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < order.size(); ++i)
        wrong += found.ring[i] == seen.rings[order[i]] ? 0 : 1;
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("clouds without beams have no rings", "[io][rings]") {
  Random random(3);
  std::uniform_real_distribution<float> place(-40.0F, 40.0F);
  for (const std::size_t size : {0, 10, 1000, 50000}) {
    std::vector<Eigen::Vector3f> points(size);
    for (Eigen::Vector3f& point : points) point = {place(random), place(random), place(random)};
    CHECK(io::find_rings(points).ring.empty());
  }
  // One plane.
  CHECK(io::find_rings(revolution_of(random, even_laser(1, 0, 0), 900).points_m).ring.empty());
}

TEST_CASE("rings of a recorded cloud without them are those of its file", "[io][rings][recorded]") {
  const io::KittiRaw drive(recording("kitti_raw_drive0002"));
  const model::PointSweep sweep = drive.read_sweep(0);
  // As the file has them: ring by ring from the top, each from ahead to the left.
  std::vector<model::SweepPoint> ordered = sweep.points;
  const auto around = [](const model::SweepPoint& point) {
    const float azimuth = std::atan2(point.y_m, point.x_m);
    return azimuth < 0.0F ? azimuth + 2.0F * static_cast<float>(M_PI) : azimuth;
  };
  std::ranges::stable_sort(ordered, [&](const auto& a, const auto& b) {
    return a.ring != b.ring ? a.ring > b.ring : around(a) < around(b);
  });
  std::vector<Eigen::Vector3f> points;
  for (const model::SweepPoint& point : ordered) points.push_back(point.position());
  const io::FoundRings found = io::find_rings(points);
  REQUIRE(found.ring.size() == ordered.size());
  // Rings that the file does not reach are missing at the bottom.
  const int lowest = ordered.back().ring;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < ordered.size(); ++i)
    wrong += found.ring[i] + lowest == ordered[i].ring ? 0 : 1;
  CHECK(wrong == 0);
}
