#include "common/hierarchy/geometric_hierarchy.hpp"

#include <algorithm>
#include <unordered_set>

namespace understory::hierarchy {

GeometricHierarchy::GeometricHierarchy(const HierarchyParameters& parameters)
    : parameters_(parameters),
      samples_(sample_count(parameters.descriptor_step)),
      index_(static_cast<float>(parameters.max_descriptor_distance)) {}

GeometricHierarchy::GeometricHierarchy(std::span<const LandmarkPosition> landmarks,
                                       const HierarchyParameters& parameters, std::size_t* refused)
    : GeometricHierarchy(parameters) {
  std::vector<Eigen::Vector2d> positions;
  std::vector<std::uint32_t> candidates;
  std::unordered_set<std::uint64_t> seen;

  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].position_m.allFinite() && seen.insert(landmarks[i].id).second) {
      positions.push_back(landmarks[i].position_m);
      candidates.push_back(static_cast<std::uint32_t>(i));
    }
  }

  std::size_t refusals = landmarks.size() - candidates.size();
  for (const std::uint32_t i : insertion_order(positions)) {
    const LandmarkPosition& landmark = landmarks[candidates[i]];
    if (triangulation_.insert(landmark.id, landmark.position_m, change_) == ChangeStatus::kDone) {
      note(change_);
      rim_.clear();  // needed only for unchanged polygons; there are none yet
    } else {
      ++refusals;
    }
  }

  remake_polygons();
  if (refused != nullptr) {
    *refused = refusals;
  }
}

ChangeStatus GeometricHierarchy::insert(std::uint64_t id, const Eigen::Vector2d& position_m) {
  const ChangeStatus status = triangulation_.insert(id, position_m, change_);
  note(change_);
  remake_polygons();
  return status;
}

ChangeStatus GeometricHierarchy::remove(std::uint64_t id) {
  const ChangeStatus status = triangulation_.remove(id, change_);
  note(change_);
  remake_polygons();
  return status;
}

ChangeStatus GeometricHierarchy::move(std::uint64_t id, const Eigen::Vector2d& position_m) {
  const ChangeStatus status = triangulation_.move(id, position_m, change_);
  note(change_);
  remake_polygons();
  return status;
}

std::vector<ChangeStatus> GeometricHierarchy::move(std::span<const LandmarkPosition> landmarks) {
  std::vector<ChangeStatus> statuses;
  statuses.reserve(landmarks.size());
  for (const LandmarkPosition& landmark : landmarks) {
    statuses.push_back(triangulation_.move(landmark.id, landmark.position_m, change_));
    note(change_);
  }
  remake_polygons();
  return statuses;
}

/// Removes the polygons of removed triangles, and lists the triangles without a polygon.
void GeometricHierarchy::note(const TriangulationChange& change) {
  polygon_of_.resize(triangulation_.triangles().size(), kNone);
  is_loose_.resize(triangulation_.triangles().size(), 0);
  for (const std::uint32_t triangle : change.removed) {
    if (polygon_of_[triangle] != kNone) {
      dissolve(polygon_of_[triangle]);
    }
  }
  for (const std::uint32_t triangle : change.made) {
    set_loose(triangle);
  }
  rim_.insert(rim_.end(), change.rim.begin(), change.rim.end());
}

void GeometricHierarchy::dissolve(std::uint32_t polygon) {
  Polygon& old = polygons_[polygon];
  index_.erase(polygon, old.descriptor);
  for (const std::uint32_t triangle : old.triangles) {
    polygon_of_[triangle] = kNone;
    set_loose(triangle);
  }
  old.boundary.clear();
  old.triangles.clear();
  free_polygons_.push_back(polygon);
}

void GeometricHierarchy::set_loose(std::uint32_t triangle) {
  if (is_loose_[triangle] == 0) {
    is_loose_[triangle] = 1;
    loose_.push_back(triangle);
  }
}

/// Makes polygons of all loose triangles. A polygon that a loose triangle reaches across a dropped
/// edge is merged.
void GeometricHierarchy::remake_polygons() {
  for (std::size_t i = 0; i < loose_.size(); ++i) {
    if (triangulation_.is_triangle(loose_[i])) {
      absorb_neighbours(loose_[i]);
    }
  }

  for (const std::uint32_t triangle : loose_) {
    if (triangulation_.is_triangle(triangle) && polygon_of_[triangle] == kNone) {
      make_polygon(triangle);
    }
  }

  for (const std::uint32_t triangle : loose_) {
    is_loose_[triangle] = 0;
  }

  loose_.clear();
  recount_hull_edges();
}

void GeometricHierarchy::absorb_neighbours(std::uint32_t triangle) {
  for (int edge = 0; edge < 3; ++edge) {
    const std::uint32_t across = triangulation_.triangles()[triangle].neighbours[edge];
    if (across != kNone && polygon_of_[across] != kNone &&
        is_dropped(triangulation_, triangle, edge)) {
      dissolve(polygon_of_[across]);
    }
  }
}

void GeometricHierarchy::make_polygon(std::uint32_t first_triangle) {
  if (free_polygons_.empty()) {
    free_polygons_.push_back(static_cast<std::uint32_t>(polygons_.size()));
    polygons_.emplace_back();
  }
  const std::uint32_t index = free_polygons_.back();
  free_polygons_.pop_back();
  Polygon& polygon = polygons_[index];

  polygon_of_[first_triangle] = index;
  polygon.triangles.push_back(first_triangle);
  for (std::size_t i = 0; i < polygon.triangles.size(); ++i) {
    const std::uint32_t triangle = polygon.triangles[i];
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t across = triangulation_.triangles()[triangle].neighbours[edge];
      if (is_dropped(triangulation_, triangle, edge) && polygon_of_[across] == kNone) {
        polygon_of_[across] = index;
        polygon.triangles.push_back(across);
      }
    }
  }
  polygon.boundary = boundary_of(triangulation_, polygon.triangles);
  polygon.hull_edges = count_hull_edges(triangulation_, polygon.triangles);
  corners_.clear();
  for (const std::uint32_t slot : polygon.boundary) {
    corners_.push_back(triangulation_.position(slot));
  }
  polygon.descriptor = describe(corners_, samples_);
  index_.insert(index, polygon.descriptor);
}

/// A triangle beside a change may now lie on the hull, or no longer, while its polygon is
/// unchanged.
void GeometricHierarchy::recount_hull_edges() {
  for (const std::uint32_t triangle : rim_) {
    if (!triangulation_.is_triangle(triangle)) {
      continue;
    }
    Polygon& polygon = polygons_[polygon_of_[triangle]];
    const auto& neighbours = triangulation_.triangles()[triangle].neighbours;
    const bool on_hull = std::find(neighbours.begin(), neighbours.end(), kNone) != neighbours.end();
    if (on_hull || polygon.touches_hull()) {
      polygon.hull_edges = count_hull_edges(triangulation_, polygon.triangles);
    }
  }
  rim_.clear();
}

std::vector<HierarchyEdge> edges(const GeometricHierarchy& hierarchy) {
  const Triangulation& triangulation = hierarchy.triangulation();
  std::vector<HierarchyEdge> result;
  for (std::uint32_t t = 0; t < triangulation.triangles().size(); ++t) {
    const Triangle& triangle = triangulation.triangles()[t];
    for (int edge = 0; edge < 3 && triangulation.is_triangle(t); ++edge) {
      const std::uint32_t across = triangle.neighbours[edge];
      if (across != kNone && across < t) {
        continue;  // found from the other side
      }

      std::uint32_t from = triangle.vertices[(edge + 1) % 3];
      std::uint32_t to = triangle.vertices[(edge + 2) % 3];
      if (triangulation.id(from) > triangulation.id(to)) {
        std::swap(from, to);
      }

      result.push_back({triangulation.id(from), triangulation.id(to), triangulation.position(from),
                        triangulation.position(to), !is_dropped(triangulation, t, edge),
                        across == kNone});
    }
  }

  std::sort(result.begin(), result.end(), [](const HierarchyEdge& a, const HierarchyEdge& b) {
    return std::pair(a.from_id, a.to_id) < std::pair(b.from_id, b.to_id);
  });

  return result;
}

}  // namespace understory::hierarchy
