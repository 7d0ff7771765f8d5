#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include "common/hierarchy/triangulation.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::hierarchy;

namespace {

using Ids = std::array<std::uint64_t, 3>;

/// Triangles by landmark id, whatever their numbering.
std::set<Ids> triangle_ids(const Triangulation& triangulation) {
  std::set<Ids> result;
  for (std::uint32_t t = 0; t < triangulation.triangles().size(); ++t) {
    if (triangulation.is_triangle(t)) {
      const auto& v = triangulation.triangles()[t].vertices;
      Ids ids{triangulation.id(v[0]), triangulation.id(v[1]), triangulation.id(v[2])};
      std::rotate(ids.begin(), std::min_element(ids.begin(), ids.end()), ids.end());
      result.insert(ids);
    }
  }
  return result;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Positive if d is inside the circle through a, b, c (counter-clockwise).
double in_circle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                 const Eigen::Vector2d& d) {
  const Eigen::Vector2d p = a - d;
  const Eigen::Vector2d q = b - d;
  const Eigen::Vector2d r = c - d;
  return p.squaredNorm() * cross(q, r) - q.squaredNorm() * cross(p, r) +
         r.squaredNorm() * cross(p, q);
}

/// Every triangle whose circle holds no other point: the definition.
std::set<Ids> brute_force(const std::vector<Eigen::Vector2d>& points) {
  std::set<Ids> result;
  for (std::uint64_t a = 0; a < points.size(); ++a) {
    for (std::uint64_t b = a + 1; b < points.size(); ++b) {
      for (std::uint64_t c = a + 1; c < points.size(); ++c) {
        if (b == c || cross(points[b] - points[a], points[c] - points[a]) <= 0.0) {
          continue;
        }
        bool empty = true;
        for (std::uint64_t d = 0; empty && d < points.size(); ++d) {
          empty = d == a || d == b || d == c ||
                  in_circle(points[a], points[b], points[c], points[d]) <= 0.0;
        }
        if (empty) {
          result.insert({a, b, c});
        }
      }
    }
  }

  return result;
}

/// Neighbours point at each other across the edge that they share.
void check_neighbours(const Triangulation& triangulation) {
  for (std::uint32_t t = 0; t < triangulation.triangles().size(); ++t) {
    const Triangle& triangle = triangulation.triangles()[t];
    for (int i = 0; i < 3 && triangulation.is_triangle(t); ++i) {
      if (triangle.neighbours[i] == kNone) {
        continue;
      }
      REQUIRE(triangulation.is_triangle(triangle.neighbours[i]));
      const Triangle& other = triangulation.triangles()[triangle.neighbours[i]];
      const auto back = std::find(other.neighbours.begin(), other.neighbours.end(), t);
      REQUIRE(back != other.neighbours.end());
      const auto j = back - other.neighbours.begin();
      REQUIRE(triangle.vertices[(i + 1) % 3] == other.vertices[(j + 2) % 3]);
      REQUIRE(triangle.vertices[(i + 2) % 3] == other.vertices[(j + 1) % 3]);
    }
  }
}

}  // namespace

TEST_CASE("Triangles are those whose circles are empty", "[hierarchy]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-50.0, 50.0);
  for (int trial = 0; trial < 20; ++trial) {
    Triangulation triangulation;
    TriangulationChange change;
    std::vector<Eigen::Vector2d> points;

    for (std::uint64_t id = 0; id < 25; ++id) {
      points.emplace_back(coordinate(random), coordinate(random));
      REQUIRE(triangulation.insert(id, points.back(), change) == ChangeStatus::kDone);
      check_neighbours(triangulation);
    }

    REQUIRE(triangle_ids(triangulation) == brute_force(points));
    for (std::uint64_t id = 24; id >= 8; --id) {
      REQUIRE(triangulation.remove(id, change) == ChangeStatus::kDone);
      points.pop_back();
      check_neighbours(triangulation);
      REQUIRE(triangle_ids(triangulation) == brute_force(points));
    }

    for (std::uint64_t id = 0; id < points.size(); ++id) {
      // Small moves keep the triangles, large ones do not: both ways must be exact.
      const double scale = id % 2 == 0 ? 0.02 : 1.0;
      points[id] += scale * Eigen::Vector2d(coordinate(random), coordinate(random));
      REQUIRE(triangulation.move(id, points[id], change) == ChangeStatus::kDone);
      check_neighbours(triangulation);
      REQUIRE(triangle_ids(triangulation) == brute_force(points));
    }
  }
}

TEST_CASE("Changes are reported completely", "[hierarchy]") {
  std::mt19937_64 random(2);
  std::uniform_int_distribution<int> cell(0, 7);
  Triangulation triangulation;
  TriangulationChange change;
  std::vector<Triangle> before;

  for (int step = 0; step < 3000; ++step) {
    before.assign(triangulation.triangles().begin(), triangulation.triangles().end());
    std::vector<Eigen::Vector2d> places(triangulation.slot_count());
    for (std::uint32_t slot = 0; slot < places.size(); ++slot) {
      places[slot] = triangulation.position(slot);
    }

    const std::uint64_t id = 1 + random() % 40;
    const Eigen::Vector2d place(cell(random), cell(random));
    switch (random() % 3) {
      case 0:
        triangulation.insert(id, place, change);
        break;
      case 1:
        triangulation.remove(id, change);
        break;
      default:
        triangulation.move(id, place, change);
    }

    const auto has = [](const std::vector<std::uint32_t>& list, std::uint32_t t) {
      return std::find(list.begin(), list.end(), t) != list.end();
    };

    before.resize(triangulation.triangles().size());
    for (std::uint32_t t = 0; t < before.size(); ++t) {
      const Triangle& now = triangulation.triangles()[t];
      bool same_shape = before[t].vertices == now.vertices;
      for (int i = 0; same_shape && i < 3 && triangulation.is_triangle(t); ++i) {
        same_shape = places[now.vertices[i]] == triangulation.position(now.vertices[i]);
      }

      if (same_shape && before[t].neighbours == now.neighbours) {
        continue;
      }

      CAPTURE(step, t);
      if (before[t].vertices[0] != kNone && !same_shape) {
        REQUIRE(has(change.removed, t));
      }

      if (triangulation.is_triangle(t)) {
        const bool reported = has(change.made, t) || (same_shape && has(change.rim, t));
        REQUIRE(reported);
      }
    }
  }
}

TEST_CASE("A move that keeps all triangles touches only those around the landmark", "[hierarchy]") {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> coordinate(-50.0, 50.0);
  Triangulation triangulation;
  TriangulationChange change;
  for (std::uint64_t id = 0; id < 60; ++id) {
    triangulation.insert(id, {coordinate(random), coordinate(random)}, change);
  }

  int kept = 0;
  for (std::uint64_t id = 0; id < 60; ++id) {
    const std::set<Ids> before = triangle_ids(triangulation);
    const std::uint32_t slot = *triangulation.slot(id);
    std::set<std::uint32_t> around;
    bool is_on_hull = false;
    for (std::uint32_t t = 0; t < triangulation.triangles().size(); ++t) {
      if (!triangulation.is_triangle(t)) continue;
      const Triangle& triangle = triangulation.triangles()[t];
      for (int i = 0; i < 3; ++i) {
        if (triangle.vertices[i] == slot) around.insert(t);
        is_on_hull =
            is_on_hull ||
            (triangle.vertices[i] != slot && triangle.neighbours[i] == kNone &&
             (triangle.vertices[(i + 1) % 3] == slot || triangle.vertices[(i + 2) % 3] == slot));
      }
    }

    const Eigen::Vector2d to = triangulation.position(slot) + Eigen::Vector2d(1e-4, -1e-4);
    REQUIRE(triangulation.move(id, to, change) == ChangeStatus::kDone);
    if (is_on_hull || triangle_ids(triangulation) != before) continue;
    ++kept;
    REQUIRE(std::set(change.made.begin(), change.made.end()) == around);
    REQUIRE(std::set(change.removed.begin(), change.removed.end()) == around);
    REQUIRE(change.rim.empty());
    REQUIRE(triangulation.slot(id) == slot);
  }
  REQUIRE(kept > 40);
}

TEST_CASE("What cannot be done is refused and changes nothing", "[hierarchy]") {
  Triangulation triangulation;
  TriangulationChange change;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  REQUIRE(triangulation.insert(1, {0.0, 0.0}, change) == ChangeStatus::kDone);
  REQUIRE(triangulation.insert(2, {4.0, 0.0}, change) == ChangeStatus::kDone);
  REQUIRE(triangulation.insert(3, {0.0, 3.0}, change) == ChangeStatus::kDone);
  REQUIRE(triangulation.insert(4, {3.0, 3.5}, change) == ChangeStatus::kDone);

  const auto before = triangle_ids(triangulation);
  REQUIRE(triangulation.insert(1, {1.0, 1.0}, change) == ChangeStatus::kIdInUse);
  REQUIRE(triangulation.insert(5, {4.0, 0.0}, change) == ChangeStatus::kCoincident);
  REQUIRE(triangulation.insert(5, {nan, 0.0}, change) == ChangeStatus::kNotFinite);
  REQUIRE(triangulation.remove(5, change) == ChangeStatus::kUnknownId);
  REQUIRE(triangulation.move(5, {1.0, 1.0}, change) == ChangeStatus::kUnknownId);
  REQUIRE(triangulation.move(1, {0.0, nan}, change) == ChangeStatus::kNotFinite);

  REQUIRE(triangulation.move(1, {3.0, 3.5}, change) == ChangeStatus::kCoincident);
  REQUIRE(change.made.empty());
  REQUIRE(triangle_ids(triangulation) == before);
  REQUIRE(triangulation.position(*triangulation.slot(1)) == Eigen::Vector2d(0.0, 0.0));
  REQUIRE(triangulation.landmark_count() == 4);
}

TEST_CASE("Fewer than three landmarks, or all in one line, have no triangles", "[hierarchy]") {
  Triangulation triangulation;
  TriangulationChange change;
  for (std::uint64_t id = 1; id <= 5; ++id) {
    triangulation.insert(id, {static_cast<double>(id), 2.0 * static_cast<double>(id)}, change);
    REQUIRE(triangulation.triangle_count() == 0);
  }

  triangulation.insert(6, {0.0, 9.0}, change);
  REQUIRE(triangulation.triangle_count() == 4);
  triangulation.move(6, {6.0, 12.0}, change);
  REQUIRE(triangulation.triangle_count() == 0);
  triangulation.move(3, {5.0, 0.0}, change);
  REQUIRE(triangulation.triangle_count() == 4);
  triangulation.remove(3, change);

  REQUIRE(triangulation.triangle_count() == 0);
}
