#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <set>

#include "eval/baselines/hierarchy/hierarchy.hpp"
#include "eval/baselines/hierarchy/matching.hpp"
#include "eval/baselines/hierarchy/similarity.hpp"
#include "tests/baseline/clouds.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

using test::moved;
using test::random_cloud;

std::vector<Eigen::Vector2d> star_polygon(std::size_t corners, std::mt19937_64& random) {
  std::uniform_real_distribution<double> radius(3.0, 9.0);
  std::vector<Eigen::Vector2d> polygon;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners);
    const double r = radius(random);
    polygon.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return polygon;
}

double signed_area(const std::vector<Eigen::Vector2d>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

TEST_CASE("A descriptor does not change with rotation and translation") {
  std::mt19937_64 random(1);
  const eval::baselines::hierarchy::DescriptorMaker describe(0.05);
  for (int i = 0; i < 200; ++i) {
    const auto polygon = star_polygon(3 + static_cast<std::size_t>(i % 9), random);
    const geometry::SE2 motion(10.0 * i, -7.0, 0.37 * i);
    CHECK((describe(polygon) - describe(test::moved(polygon, motion))).norm() < 1e-9);
  }
}

TEST_CASE("A descriptor does not change with a start moved by whole samples") {
  const eval::baselines::hierarchy::DescriptorMaker describe(0.05);
  // Corners every fifth of the perimeter: each start is a whole number of samples further on.
  const auto corner = [](int i) {
    const double angle = 2.0 * std::numbers::pi * i / 5.0;
    return Eigen::Vector2d(4.0 * std::cos(angle), 4.0 * std::sin(angle));
  };
  std::vector<Eigen::Vector2d> pentagon;
  for (int i = 0; i < 5; ++i) {
    pentagon.push_back(corner(i));
  }
  const eval::baselines::hierarchy::Descriptor first = describe(pentagon);
  std::rotate(pentagon.begin(), pentagon.begin() + 2, pentagon.end());
  CHECK((describe(pentagon) - first).norm() < 1e-9);
}

TEST_CASE("The distance of two descriptors is that over all bins of the DFT") {
  std::mt19937_64 random(2);
  const eval::baselines::hierarchy::DescriptorMaker describe(0.05);

  // Regular 20-gons with radii of their own: samples are not the corners, so sample by hand.
  const auto all_bins = [](const std::vector<Eigen::Vector2d>& polygon) {
    Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
    double perimeter = 0.0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      centroid += polygon[i] / static_cast<double>(polygon.size());
      perimeter += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
    }
    Eigen::VectorXd bins(20);
    for (int k = 0; k < 20; ++k) {
      std::complex<double> sum = 0.0;
      for (int s = 0; s < 20; ++s) {
        double left = perimeter * s / 20.0;
        std::size_t edge = 0;
        while (left > (polygon[(edge + 1) % polygon.size()] - polygon[edge]).norm()) {
          left -= (polygon[(edge + 1) % polygon.size()] - polygon[edge]).norm();
          ++edge;
        }
        const Eigen::Vector2d along = polygon[(edge + 1) % polygon.size()] - polygon[edge];
        const double radius = (polygon[edge] + left * along.normalized() - centroid).norm();
        sum += std::polar(radius, -2.0 * std::numbers::pi * k * s / 20.0);
      }
      bins(k) = std::abs(sum);
    }
    return bins;
  };

  for (int i = 0; i < 50; ++i) {
    const auto a = star_polygon(5, random);
    const auto b = star_polygon(7, random);
    const double expected = (all_bins(a) - all_bins(b)).norm();
    CHECK((describe(a) - describe(b)).norm() == Approx(expected).epsilon(1e-9));
  }
}

TEST_CASE("Polygons are the triangles joined across longest edges") {
  std::mt19937_64 random(3);
  for (int round = 0; round < 20; ++round) {
    const auto cloud = test::random_cloud(80, 80.0, random);
    const eval::baselines::hierarchy::Hierarchy hierarchy(cloud, 0.05);
    const auto triangles = hierarchy.triangles();
    // Oracle: spread labels across longest edges until nothing changes.
    std::vector<std::size_t> label(triangles.size());
    std::iota(label.begin(), label.end(), 0U);
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& lengths = triangles[t].edge_lengths_m;
        const auto i = static_cast<std::size_t>(std::max_element(lengths.begin(), lengths.end()) -
                                                lengths.begin());
        for (std::size_t u = 0; u < triangles.size(); ++u) {
          const auto& corners = triangles[u].vertices;
          const bool shares =
              u != t && std::count(corners.begin(), corners.end(), triangles[t].vertices[i]) == 1 &&
              std::count(corners.begin(), corners.end(), triangles[t].vertices[(i + 1) % 3]) == 1;
          if (shares && label[u] != label[t]) {
            label[u] = label[t] = std::min(label[u], label[t]);
            changed = true;
          }
        }
      }
    }
    std::set<std::set<std::uint32_t>> expected;
    for (std::size_t root = 0; root < label.size(); ++root) {
      std::set<std::uint32_t> group;
      for (std::uint32_t t = 0; t < label.size(); ++t) {
        if (label[t] == root) {
          group.insert(t);
        }
      }
      if (!group.empty()) {
        expected.insert(group);
      }
    }
    std::set<std::set<std::uint32_t>> found;
    for (const eval::baselines::hierarchy::Polygon& polygon : hierarchy.polygons()) {
      found.emplace(polygon.triangles.begin(), polygon.triangles.end());
    }
    CHECK(found == expected);
  }
}

TEST_CASE("A polygon's boundary encloses exactly its triangles") {
  std::mt19937_64 random(4);
  const auto cloud = test::random_cloud(300, 150.0, random);
  const eval::baselines::hierarchy::Hierarchy hierarchy(cloud, 0.05);
  const auto corners = [&](const auto& vertices) {
    std::vector<Eigen::Vector2d> points;
    for (const std::uint32_t vertex : vertices) {
      points.push_back(cloud[vertex]);
    }
    return points;
  };

  for (const eval::baselines::hierarchy::Polygon& polygon : hierarchy.polygons()) {
    CHECK(polygon.vertices.size() == polygon.triangles.size() + 2);
    double area = 0.0;
    for (const std::uint32_t t : polygon.triangles) {
      area += signed_area(corners(hierarchy.triangles()[t].vertices));
    }
    CHECK(signed_area(corners(polygon.vertices)) == Approx(area).epsilon(1e-9));
  }
}

TEST_CASE("No landmark lies in the circumcircle of a triangle") {
  std::mt19937_64 random(5);
  const auto cloud = test::random_cloud(60, 60.0, random);
  for (const eval::baselines::hierarchy::DelaunayTriangle& triangle :
       eval::baselines::hierarchy::delaunay(cloud)) {
    for (const Eigen::Vector2d& point : cloud) {
      Eigen::Matrix3d lifted;
      for (int row = 0; row < 3; ++row) {
        const Eigen::Vector2d d = cloud[triangle.vertices[static_cast<std::size_t>(row)]] - point;
        lifted.row(row) << d.x(), d.y(), d.squaredNorm();
      }
      CHECK(lifted.determinant() < 1e-6);
    }
  }
}

TEST_CASE("Landmarks on one line make an empty hierarchy") {
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < 5; ++i) {
    line.emplace_back(i, 2.0 * i);
  }
  CHECK(eval::baselines::hierarchy::Hierarchy(line, 0.05).polygons().empty());
  CHECK(match_hierarchies(eval::baselines::hierarchy::Hierarchy(line, 0.05),
                          eval::baselines::hierarchy::Hierarchy(line, 0.05), {})
            .empty());
}

TEST_CASE("Moved landmarks change edge lengths and leave descriptors") {
  std::mt19937_64 random(6);
  const auto cloud = test::random_cloud(50, 60.0, random);
  eval::baselines::hierarchy::Hierarchy hierarchy(cloud, 0.05);
  const eval::baselines::hierarchy::Descriptor descriptor = hierarchy.polygons()[3].descriptor;
  auto wide = cloud;
  for (Eigen::Vector2d& point : wide) {
    point *= 2.0;
  }
  const double length = hierarchy.triangles()[7].edge_lengths_m[1];
  hierarchy.move_points(wide);
  CHECK(hierarchy.triangles()[7].edge_lengths_m[1] == Approx(2.0 * length));
  CHECK(hierarchy.polygons()[3].descriptor == descriptor);
}

}  // namespace
}  // namespace understory::test
