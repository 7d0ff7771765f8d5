#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "common/hierarchy/geometric_hierarchy.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::hierarchy;

namespace {

/// What a polygon is, apart from its numbering.
struct Summary {
  std::vector<std::uint64_t> ids;
  Descriptor descriptor;
  std::uint32_t hull_edges = 0;
  std::size_t triangles = 0;
  auto operator<=>(const Summary&) const = default;
};

std::vector<Summary> summarise(const GeometricHierarchy& hierarchy) {
  std::vector<Summary> result;
  for (const Polygon& polygon : hierarchy.polygons()) {
    if (polygon.exists()) {
      Summary& summary = result.emplace_back();
      for (const std::uint32_t slot : polygon.boundary) {
        summary.ids.push_back(hierarchy.triangulation().id(slot));
      }
      summary.descriptor = polygon.descriptor;
      summary.hull_edges = polygon.hull_edges;
      summary.triangles = polygon.triangles.size();
    }
  }

  std::sort(result.begin(), result.end());
  return result;
}

void check_same_as_from_scratch(const GeometricHierarchy& changed,
                                const std::map<std::uint64_t, Eigen::Vector2d>& landmarks) {
  std::vector<LandmarkPosition> list;
  for (const auto& [id, position] : landmarks) {
    list.push_back({id, position});
  }

  const GeometricHierarchy fresh(list);
  REQUIRE(changed.triangulation().landmark_count() == landmarks.size());
  REQUIRE(changed.triangulation().triangle_count() == fresh.triangulation().triangle_count());

  // Bit for bit: same walks from the same vertex, so the same sums.
  REQUIRE(summarise(changed) == summarise(fresh));
  REQUIRE(changed.index().size() == changed.polygon_count());
  for (std::uint32_t p = 0; p < changed.polygons().size(); ++p) {
    const Polygon& polygon = changed.polygons()[p];
    if (polygon.exists()) {
      std::vector<DescriptorIndex::Hit> hits;
      changed.index().within(polygon.descriptor, 0.0F, hits);
      REQUIRE(std::any_of(hits.begin(), hits.end(), [p](const auto& hit) { return hit.key == p; }));
      for (const std::uint32_t triangle : polygon.triangles) {
        REQUIRE(changed.polygon_of(triangle) == p);
      }
    }
  }
}

/// Random insertions, removals and moves; `place` draws positions, `nudge` small displacements.
template <class Place, class Nudge>
void change_at_random(std::mt19937_64& random, std::size_t typical_size, int steps, int check_every,
                      const Place& place, const Nudge& nudge) {
  GeometricHierarchy hierarchy;
  std::map<std::uint64_t, Eigen::Vector2d> landmarks;
  std::uint64_t next_id = 1;

  for (int step = 1; step <= steps; ++step) {
    const bool grow = landmarks.size() < typical_size / 2 || random() % 2 == 0;
    const auto any = [&] {
      auto it = landmarks.lower_bound(1 + random() % next_id);
      return it == landmarks.end() ? landmarks.begin() : it;
    };

    if (landmarks.empty() || (random() % 3 == 0 && grow && landmarks.size() < typical_size)) {
      const Eigen::Vector2d position = place();
      if (hierarchy.insert(next_id, position) == ChangeStatus::kDone) {
        landmarks[next_id] = position;
      }

      ++next_id;
    } else if (random() % 3 == 0 && !grow) {
      const auto it = any();
      REQUIRE(hierarchy.remove(it->first) == ChangeStatus::kDone);
      landmarks.erase(it);
    } else {
      const auto it = any();
      const Eigen::Vector2d position = random() % 8 == 0 ? place() : it->second + nudge();
      if (hierarchy.move(it->first, position) == ChangeStatus::kDone) {
        it->second = position;
      }
    }

    if (step % check_every == 0) {
      CAPTURE(step);
      check_same_as_from_scratch(hierarchy, landmarks);
    }
  }
}

std::vector<LandmarkPosition> random_landmarks(std::mt19937_64& random, std::size_t count,
                                               double half_side_m) {
  std::uniform_real_distribution<double> coordinate(-half_side_m, half_side_m);
  std::vector<LandmarkPosition> result;
  for (std::size_t i = 0; i < count; ++i) {
    result.push_back({i + 1, {coordinate(random), coordinate(random)}});
  }
  return result;
}

}  // namespace

TEST_CASE("Changed in place is the same as built from scratch", "[hierarchy]") {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> coordinate(-60.0, 60.0);
  std::normal_distribution<double> small(0.0, 0.3);
  change_at_random(
      random, 250, 6000, 60,
      [&] { return Eigen::Vector2d(coordinate(random), coordinate(random)); },
      [&] { return Eigen::Vector2d(small(random), small(random)); });
}

TEST_CASE("So it is where points are cocircular, in line, and edges equally long", "[hierarchy]") {
  std::mt19937_64 random(12);
  std::uniform_int_distribution<int> coordinate(0, 9);
  std::uniform_int_distribution<int> small(-1, 1);
  change_at_random(
      random, 60, 6000, 10, [&] { return Eigen::Vector2d(coordinate(random), coordinate(random)); },
      [&] { return Eigen::Vector2d(small(random), small(random)); });
}

TEST_CASE("So it is with so few landmarks that they often lie in one line", "[hierarchy]") {
  std::mt19937_64 random(13);
  std::uniform_int_distribution<int> coordinate(0, 3);
  std::uniform_int_distribution<int> small(-1, 1);
  change_at_random(
      random, 7, 4000, 1, [&] { return Eigen::Vector2d(coordinate(random), coordinate(random)); },
      [&] { return Eigen::Vector2d(small(random), small(random)); });
}

TEST_CASE("So it is on a circle, where every four points are cocircular", "[hierarchy]") {
  // Integer points of the circle x^2 + y^2 = 65^2 are exactly cocircular.
  std::vector<Eigen::Vector2d> circle;
  for (int x = -65; x <= 65; ++x) {
    for (int y = -65; y <= 65; ++y) {
      if (x * x + y * y == 65 * 65) {
        circle.emplace_back(x, y);
      }
    }
  }

  REQUIRE(circle.size() == 36);
  circle.emplace_back(0.0, 0.0);  // a hub: its removal leaves a hole with many sides
  std::mt19937_64 random(14);
  change_at_random(
      random, 37, 4000, 5, [&] { return circle[random() % circle.size()]; },
      [&] { return Eigen::Vector2d::Zero(); });
}

TEST_CASE("The polygons are the components across longest edges", "[hierarchy]") {
  std::mt19937_64 random(15);
  const auto landmarks = random_landmarks(random, 400, 80.0);
  const GeometricHierarchy hierarchy(landmarks);
  const Triangulation& triangulation = hierarchy.triangulation();
  std::size_t boundary_edges = 0;
  std::size_t triangles = 0;

  for (const Polygon& polygon : hierarchy.polygons()) {
    REQUIRE(polygon.boundary.size() == polygon.triangles.size() + 2);
    boundary_edges += polygon.boundary.size();
    triangles += polygon.triangles.size();
    double area = 0.0;

    for (std::size_t i = 0; i < polygon.boundary.size(); ++i) {
      const Eigen::Vector2d a = triangulation.position(polygon.boundary[i]);
      const Eigen::Vector2d b =
          triangulation.position(polygon.boundary[(i + 1) % polygon.boundary.size()]);
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    }

    double sum = 0.0;
    for (const std::uint32_t t : polygon.triangles) {
      const auto& v = triangulation.triangles()[t].vertices;
      const Eigen::Vector2d ab = triangulation.position(v[1]) - triangulation.position(v[0]);
      const Eigen::Vector2d ac = triangulation.position(v[2]) - triangulation.position(v[0]);
      sum += 0.5 * (ab.x() * ac.y() - ab.y() * ac.x());
    }

    REQUIRE(area == Approx(sum));
  }

  REQUIRE(triangles == triangulation.triangle_count());

  // The oracle: a triangle and its neighbour across its longest edge share a polygon, and nothing
  // else joins polygons (a forest with as many trees as polygons).
  std::size_t joins = 0;
  std::size_t kept = 0;
  for (const HierarchyEdge& edge : edges(hierarchy)) {
    joins += edge.in_polygon_boundary ? 0 : 1;
    kept += edge.in_polygon_boundary ? (edge.on_hull ? 1 : 2) : 0;
  }

  REQUIRE(joins == triangles - hierarchy.polygon_count());
  REQUIRE(kept == boundary_edges);
  for (std::uint32_t t = 0; t < triangulation.triangles().size(); ++t) {
    const Triangle& triangle = triangulation.triangles()[t];
    double longest = 0.0;
    std::uint32_t across = kNone;

    for (int i = 0; i < 3; ++i) {
      const double length = (triangulation.position(triangle.vertices[(i + 1) % 3]) -
                             triangulation.position(triangle.vertices[(i + 2) % 3]))
                                .norm();
      if (length > longest) {
        longest = length;
        across = triangle.neighbours[i];
      }
    }

    if (across != kNone) {
      REQUIRE(hierarchy.polygon_of(across) == hierarchy.polygon_of(t));
    }
  }
}

TEST_CASE("Polygons know whether they touch the hull", "[hierarchy]") {
  std::mt19937_64 random(16);
  const GeometricHierarchy hierarchy(random_landmarks(random, 300, 80.0));
  std::size_t hull = 0;

  for (const HierarchyEdge& edge : edges(hierarchy)) {
    hull += edge.on_hull ? 1 : 0;
  }

  std::size_t counted = 0;
  std::size_t inside = 0;
  for (const Polygon& polygon : hierarchy.polygons()) {
    counted += polygon.hull_edges;
    inside += polygon.touches_hull() ? 0 : 1;
  }

  REQUIRE(hull >= 3);
  REQUIRE(counted == hull);
  REQUIRE(inside > hierarchy.polygon_count() / 2);
}

TEST_CASE("Many moves at once are the same as one by one", "[hierarchy]") {
  std::mt19937_64 random(17);
  std::normal_distribution<double> small(0.0, 1.0);
  auto landmarks = random_landmarks(random, 500, 80.0);
  GeometricHierarchy hierarchy(landmarks);
  std::map<std::uint64_t, Eigen::Vector2d> expected;

  for (LandmarkPosition& landmark : landmarks) {
    landmark.position_m += Eigen::Vector2d(small(random), small(random));
    expected[landmark.id] = landmark.position_m;
  }

  for (const ChangeStatus status : hierarchy.move(landmarks)) {
    REQUIRE(status == ChangeStatus::kDone);
  }

  check_same_as_from_scratch(hierarchy, expected);
}

TEST_CASE("Landmarks that cannot be taken are counted", "[hierarchy]") {
  std::mt19937_64 random(18);
  auto landmarks = random_landmarks(random, 20, 10.0);
  landmarks.push_back({100, landmarks[3].position_m});
  landmarks.push_back({4, {50.0, 50.0}});
  landmarks.push_back({101, {std::nan(""), 0.0}});
  std::size_t refused = 0;
  const GeometricHierarchy hierarchy(landmarks, {}, &refused);
  REQUIRE(refused == 3);
  REQUIRE(hierarchy.triangulation().landmark_count() == 20);
}
