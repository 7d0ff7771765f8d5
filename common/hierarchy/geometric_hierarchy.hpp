// Landmarks -> triangles -> polygons -> descriptors -> index, updated in place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/hierarchy/descriptor_index.hpp"
#include "common/hierarchy/polygon.hpp"
#include "common/hierarchy/triangulation.hpp"

namespace understory::hierarchy {

/// Resolution of the descriptors and of their index.
struct HierarchyParameters {
  double descriptor_step = 0.05;         ///< [s] part of the perimeter; 1/30 ... 1/4.
  double max_descriptor_distance = 2.0;  ///< [tau] the index is fastest for radii up to this.
};

/// A landmark by its permanent id, in any one frame.
struct LandmarkPosition {
  std::uint64_t id = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
};

/// The geometric hierarchy of a set of landmarks (GeoSLAM §3.2). A change costs only the changed
/// triangles (a handful) and their polygons (future work in GeoSLAM §7.1). The hierarchy depends on
/// the set of landmarks alone, not on its history; only the numbering of slots, triangles and
/// polygons does.
class GeometricHierarchy {
 public:
  /// An empty hierarchy.
  explicit GeometricHierarchy(const HierarchyParameters& parameters = {});
  /// Builds from many landmarks at once, each polygon once. Of several with one id the first is
  /// used, of several at one position any one; the others and positions that are not finite are
  /// counted in `refused`, if given.
  explicit GeometricHierarchy(std::span<const LandmarkPosition> landmarks,
                              const HierarchyParameters& parameters = {},
                              std::size_t* refused = nullptr);

  /// Adds a landmark. Refused (and nothing is changed): an id in use, a position taken, a position
  /// that is not finite.
  ChangeStatus insert(std::uint64_t id, const Eigen::Vector2d& position_m);
  /// Removes a landmark. Refused: an unknown id.
  ChangeStatus remove(std::uint64_t id);
  /// Gives a landmark a new position. Refused (and nothing is changed): an unknown id, a position
  /// taken, a position that is not finite.
  ChangeStatus move(std::uint64_t id, const Eigen::Vector2d& position_m);
  /// Many moves, after which each polygon is made once; for corrections of the whole map. Returns
  /// one status per landmark.
  std::vector<ChangeStatus> move(std::span<const LandmarkPosition> landmarks);

  /// The triangulation on which the polygons are built.
  const Triangulation& triangulation() const { return triangulation_; }
  /// Polygons by index; an index with !exists() is free.
  std::span<const Polygon> polygons() const { return polygons_; }
  /// Number of polygons that exist.
  std::size_t polygon_count() const { return polygons_.size() - free_polygons_.size(); }
  /// The polygon that a triangle belongs to.
  std::uint32_t polygon_of(std::uint32_t triangle) const { return polygon_of_[triangle]; }
  /// Index of descriptors; keys are polygon indices.
  const DescriptorIndex& index() const { return index_; }
  /// The parameters given to the constructor.
  const HierarchyParameters& parameters() const { return parameters_; }

 private:
  void note(const TriangulationChange& change);
  void dissolve(std::uint32_t polygon);
  void set_loose(std::uint32_t triangle);
  void remake_polygons();
  void absorb_neighbours(std::uint32_t triangle);
  void make_polygon(std::uint32_t first_triangle);
  void recount_hull_edges();

  HierarchyParameters parameters_;
  int samples_;
  Triangulation triangulation_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> free_polygons_;
  std::vector<std::uint32_t> polygon_of_;  // by triangle
  DescriptorIndex index_;
  // Work lists of the present change; members to reuse their memory.
  std::vector<std::uint32_t> loose_;  // triangles without a polygon, each once
  std::vector<char> is_loose_;        // by triangle
  std::vector<std::uint32_t> rim_;
  TriangulationChange change_;
  std::vector<Eigen::Vector2d> corners_;
};

/// An edge of the triangulation, for plots.
struct HierarchyEdge {
  std::uint64_t from_id = 0;  ///< from_id < to_id.
  std::uint64_t to_id = 0;
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  bool in_polygon_boundary = true;  ///< False: dropped, it lies inside a polygon.
  bool on_hull = false;
};

/// Every edge once, in order of ids.
std::vector<HierarchyEdge> edges(const GeometricHierarchy& hierarchy);

}  // namespace understory::hierarchy
