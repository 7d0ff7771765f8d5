#include "common/hierarchy/triangulation.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include "common/hierarchy/location_hints.hpp"

namespace understory::hierarchy {
/// The CGAL part. Its faces store the index of their Triangle; a change visits only the faces
/// around it.
struct Triangulation::Impl {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_2;

  struct FaceInfo {
    std::uint32_t triangle = kNone;
    std::uint32_t visit = 0;
  };

  using Delaunay = CGAL::Delaunay_triangulation_2<
      Kernel, CGAL::Triangulation_data_structure_2<
                  CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>,
                  CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>>;
  using Face = Delaunay::Face_handle;
  using Vertex = Delaunay::Vertex_handle;

  static Point to_cgal(const Eigen::Vector2d& p) { return {p.x(), p.y()}; }

  explicit Impl(Triangulation* owner) : self(owner) {}

  Triangulation* self;
  Delaunay delaunay;
  std::vector<Vertex> vertices;  // by landmark slot; null where free
  LocationHints hints;
  std::uint32_t last_slot = kNone;
  std::uint32_t visit = 0;
  std::vector<Face> scratch_faces;
  std::vector<Face> scratch_rim;

  Face start_near(const Eigen::Vector2d& position) const {
    if (const auto slot = hints.near(position); slot && self->is_landmark(*slot)) {
      return vertices[*slot]->face();
    }
    if (last_slot != kNone && self->is_landmark(last_slot)) return vertices[last_slot]->face();
    return {};
  }

  /// Place of a new landmark.
  struct Place {
    Face face;
    Delaunay::Locate_type type{};
    int index = 0;
    bool occupied() const { return type == Delaunay::VERTEX; }
  };

  Place locate(const Eigen::Vector2d& position) const {
    Place place;
    place.face = delaunay.locate(to_cgal(position), place.type, place.index, start_near(position));
    return place;
  }

  void release(std::uint32_t triangle, TriangulationChange& change) {
    self->triangles_[triangle] = Triangle{};
    self->free_triangles_.push_back(triangle);
    change.removed.push_back(triangle);
  }

  void allocate(Face face, TriangulationChange& change) {
    if (self->free_triangles_.empty()) {
      self->free_triangles_.push_back(static_cast<std::uint32_t>(self->triangles_.size()));
      self->triangles_.emplace_back();
    }
    face->info().triangle = self->free_triangles_.back();
    self->free_triangles_.pop_back();
    change.made.push_back(face->info().triangle);
  }

  /// Copies a face's vertices and neighbours into its Triangle.
  void refresh(Face face) {
    Triangle& triangle = self->triangles_[face->info().triangle];
    for (int i = 0; i < 3; ++i) {
      triangle.vertices[i] = face->vertex(i)->info();
      triangle.neighbours[i] = face->neighbor(i)->info().triangle;
    }
  }

  /// Makes new triangles for the finite `faces` and links their neighbours to them.
  void adopt(const std::vector<Face>& faces, const std::vector<Face>& rim,
             TriangulationChange& change) {
    for (const Face& face : faces) {
      face->info().triangle = kNone;
    }

    for (const Face& face : faces) {
      if (!delaunay.is_infinite(face)) {
        allocate(face, change);
      }
    }

    for (const Face& face : faces) {
      if (face->info().triangle != kNone) {
        refresh(face);
        self->find_longest_edge(self->triangles_[face->info().triangle]);
      }
    }

    for (const Face& face : rim) {
      if (face->info().triangle != kNone) {
        refresh(face);
        change.rim.push_back(face->info().triangle);
      }
    }
  }

  /// With fewer than three landmarks, or all in one line: makes every triangle again.
  void adopt_everything(TriangulationChange& change) {
    for (std::uint32_t i = 0; i < self->triangles_.size(); ++i) {
      if (self->is_triangle(i)) {
        release(i, change);
      }
    }
    scratch_faces.clear();
    if (delaunay.dimension() == 2) {
      for (auto face = delaunay.all_faces_begin(); face != delaunay.all_faces_end(); ++face) {
        scratch_faces.emplace_back(face);
      }
    }
    adopt(scratch_faces, {}, change);
  }

  /// The faces around a vertex and, across the edges opposite to it, those around them.
  void collect_star(Vertex vertex, std::vector<Face>& star, std::vector<Face>& rim) const {
    star.clear();
    rim.clear();
    auto circulator = delaunay.incident_faces(vertex);
    const auto done = circulator;
    do {
      star.emplace_back(circulator);
      rim.push_back(circulator->neighbor(circulator->index(vertex)));
    } while (++circulator != done);
  }

  Vertex insert(std::uint32_t slot, const Point& point, const Place& place,
                TriangulationChange& change) {
    const int dimension_before = delaunay.dimension();
    const Vertex vertex = delaunay.insert(point, place.type, place.face, place.index);
    vertex->info() = slot;

    if (dimension_before < 2 || delaunay.dimension() < 2) {
      adopt_everything(change);
      return vertex;
    }

    // CGAL inserts by flips, which keep their faces: each face that lost its triangle is now at the
    // new vertex and still has the old index.
    collect_star(vertex, scratch_faces, scratch_rim);
    for (const Face& face : scratch_faces) {
      if (face->info().triangle != kNone) {
        release(face->info().triangle, change);
      }
    }

    adopt(scratch_faces, scratch_rim, change);
    return vertex;
  }

  void remove(Vertex vertex, TriangulationChange& change) {
    if (delaunay.dimension() < 2) {
      delaunay.remove(vertex);
      adopt_everything(change);
      return;
    }

    collect_star(vertex, scratch_faces, scratch_rim);
    std::vector<std::uint32_t> old;
    for (const Face& face : scratch_faces) {
      if (face->info().triangle != kNone) {
        old.push_back(face->info().triangle);
      }
    }

    // The removal keeps the rim's faces and the index of their edge at the hole.
    std::vector<int> looks_inside;
    for (std::size_t i = 0; i < scratch_rim.size(); ++i) {
      looks_inside.push_back(scratch_rim[i]->index(scratch_faces[i]));
    }

    delaunay.remove(vertex);
    if (delaunay.dimension() < 2) {
      adopt_everything(change);
      return;
    }

    for (const std::uint32_t triangle : old) {
      release(triangle, change);
    }

    flood_hole(looks_inside);
    adopt(scratch_faces, scratch_rim, change);
  }

  /// Sets scratch_faces to the faces that fill the hole inside scratch_rim.
  void flood_hole(const std::vector<int>& looks_inside) {
    ++visit;
    scratch_faces.clear();
    for (const Face& face : scratch_rim) {
      face->info().visit = visit;
    }

    const auto visit_face = [this](Face face) {
      if (face->info().visit != visit) {
        face->info().visit = visit;
        scratch_faces.push_back(face);
      }
    };

    for (std::size_t i = 0; i < scratch_rim.size(); ++i) {
      visit_face(scratch_rim[i]->neighbor(looks_inside[i]));
    }

    for (std::size_t i = 0; i < scratch_faces.size(); ++i) {
      for (int j = 0; j < 3; ++j) {
        visit_face(scratch_faces[i]->neighbor(j));
      }
    }
  }

  bool turns_left(Face face) const {
    return delaunay.orientation(face->vertex(0)->point(), face->vertex(1)->point(),
                                face->vertex(2)->point()) == CGAL::LEFT_TURN;
  }

  bool is_locally_delaunay(Face face, int i) const {
    const Vertex opposite = delaunay.tds().mirror_vertex(face, i);
    return delaunay.side_of_oriented_circle(face, opposite->point(), true) !=
           CGAL::ON_POSITIVE_SIDE;
  }

  /// Moves a vertex if this keeps all triangles; only for a vertex inside the hull.
  bool move_in_place(Vertex vertex, const Point& point) {
    if (delaunay.dimension() < 2) return false;

    collect_star(vertex, scratch_faces, scratch_rim);
    for (const Face& face : scratch_faces) {
      if (delaunay.is_infinite(face)) return false;
    }

    const Point before = vertex->point();
    vertex->set_point(point);
    bool keeps = true;

    for (std::size_t i = 0; keeps && i < scratch_faces.size(); ++i) {
      keeps = turns_left(scratch_faces[i]);
    }

    for (std::size_t i = 0; keeps && i < scratch_faces.size(); ++i) {
      const int v = scratch_faces[i]->index(vertex);
      keeps = is_locally_delaunay(scratch_faces[i], Delaunay::ccw(v)) &&
              (delaunay.is_infinite(scratch_rim[i]) || is_locally_delaunay(scratch_faces[i], v));
    }

    if (!keeps) {
      vertex->set_point(before);
    }

    return keeps;
  }

  /// Any landmark that shares an edge with this one.
  std::optional<std::uint32_t> some_neighbour(Vertex vertex) const {
    if (delaunay.dimension() < 1) return std::nullopt;
    auto circulator = delaunay.incident_vertices(vertex);
    const auto done = circulator;
    do {
      if (!delaunay.is_infinite(circulator)) return circulator->info();
    } while (++circulator != done);
    return std::nullopt;
  }
};

Triangulation::Triangulation() : impl_(std::make_unique<Impl>(this)) {}
Triangulation::~Triangulation() = default;

Triangulation::Triangulation(Triangulation&& other) noexcept { *this = std::move(other); }

Triangulation& Triangulation::operator=(Triangulation&& other) noexcept {
  impl_ = std::move(other.impl_);
  triangles_ = std::move(other.triangles_);
  free_triangles_ = std::move(other.free_triangles_);
  ids_ = std::move(other.ids_);
  positions_ = std::move(other.positions_);
  free_slots_ = std::move(other.free_slots_);
  slot_of_id_ = std::move(other.slot_of_id_);
  impl_->self = this;
  return *this;
}

bool Triangulation::is_landmark(std::uint32_t slot) const {
  return slot < impl_->vertices.size() && impl_->vertices[slot] != Impl::Vertex();
}

std::uint32_t Triangulation::allocate_slot(std::uint64_t id, const Eigen::Vector2d& position_m) {
  if (free_slots_.empty()) {
    free_slots_.push_back(static_cast<std::uint32_t>(ids_.size()));
    ids_.emplace_back();
    positions_.emplace_back();
    impl_->vertices.emplace_back();
  }
  const std::uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  ids_[slot] = id;
  positions_[slot] = position_m;
  slot_of_id_.emplace(id, slot);
  return slot;
}

void Triangulation::release_slot(std::uint32_t slot) {
  slot_of_id_.erase(ids_[slot]);
  impl_->vertices[slot] = Impl::Vertex();
  free_slots_.push_back(slot);
}

ChangeStatus Triangulation::insert(std::uint64_t id, const Eigen::Vector2d& position_m,
                                   TriangulationChange& change) {
  change.clear();
  if (!position_m.allFinite()) return ChangeStatus::kNotFinite;
  if (slot_of_id_.contains(id)) return ChangeStatus::kIdInUse;

  const Impl::Place place = impl_->locate(position_m);
  if (place.occupied()) return ChangeStatus::kCoincident;

  const std::uint32_t slot = allocate_slot(id, position_m);
  impl_->vertices[slot] = impl_->insert(slot, Impl::to_cgal(position_m), place, change);
  impl_->hints.remember(position_m, slot);
  impl_->last_slot = slot;

  return ChangeStatus::kDone;
}

ChangeStatus Triangulation::remove(std::uint64_t id, TriangulationChange& change) {
  change.clear();
  const auto found = slot(id);
  if (!found) return ChangeStatus::kUnknownId;
  const Impl::Vertex vertex = impl_->vertices[*found];
  const auto neighbour = impl_->some_neighbour(vertex);
  impl_->hints.forget(positions_[*found], *found, neighbour);
  impl_->last_slot = neighbour.value_or(kNone);
  impl_->remove(vertex, change);
  release_slot(*found);
  return ChangeStatus::kDone;
}

ChangeStatus Triangulation::move(std::uint64_t id, const Eigen::Vector2d& position_m,
                                 TriangulationChange& change) {
  change.clear();
  if (!position_m.allFinite()) return ChangeStatus::kNotFinite;

  const auto found = slot(id);
  if (!found) return ChangeStatus::kUnknownId;

  const Impl::Point point = Impl::to_cgal(position_m);
  const Impl::Vertex vertex = impl_->vertices[*found];
  if (vertex->point() == point) return ChangeStatus::kDone;

  if (impl_->move_in_place(vertex, point)) {
    positions_[*found] = position_m;
    for (const Impl::Face& face : impl_->scratch_faces) {
      find_longest_edge(triangles_[face->info().triangle]);
      change.made.push_back(face->info().triangle);
    }
    change.removed = change.made;
    return ChangeStatus::kDone;
  }

  if (impl_->locate(position_m).occupied()) return ChangeStatus::kCoincident;

  TriangulationChange removal;
  remove(id, removal);
  insert(id, position_m, change);
  change.prepend(removal, triangles_);

  return ChangeStatus::kDone;
}

}  // namespace understory::hierarchy
