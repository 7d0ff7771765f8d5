// Landmark pairs between two hierarchies: polygons, then their triangles, then vertices.
#pragma once

#include <cstdint>
#include <vector>

#include "common/hierarchy/geometric_hierarchy.hpp"

namespace understory::hierarchy {

/// Thresholds of matching; symbols as in GeoSLAM §3.2.3.
struct MatchParameters {
  double max_descriptor_distance = 2.0;   ///< [tau]
  int max_side_difference = 3;            ///< [Delta_N] sides of two polygons.
  double min_triangle_match_ratio = 0.5;  ///< [eta] of the triangles of the smaller polygon.
  /// Largest difference of each edge of two matched triangles; about four times the noise of a
  /// landmark.
  double max_edge_difference_m = 0.6;
  /// Largest distance of a landmark pair after alignment of the two polygons.
  double max_residual_m = 0.5;
};

/// Two polygons that are each other's nearest within tau.
struct PolygonMatch {
  std::uint32_t query = 0;  ///< Polygon index in the query.
  std::uint32_t map = 0;
  float distance = 0.0F;
};

/// A landmark of the query that is probably a landmark of the map.
struct LandmarkMatch {
  std::uint64_t query_id = 0;
  std::uint64_t map_id = 0;
  /// Sum, over the polygon matches with this pair, of their pairs beyond the two that determine a
  /// transform; a match has less weight for a large descriptor distance and if it touches a hull.
  double score = 0.0;
};

/// Mutually nearest polygons (GeoSLAM §3.2.3, §4.5.4), in order of the query's polygon indices. The
/// map is accessed through its index only: time grows with the map's polygons within tau, not with
/// the map.
std::vector<PolygonMatch> match_polygons(const GeometricHierarchy& query,
                                         const GeometricHierarchy& map,
                                         const MatchParameters& parameters = {});

/// Landmark pairs of one polygon match; empty if too few of its triangles match. Mirror images
/// never match: triangles are compared in their counter-clockwise order, and the pairs must fit one
/// rigid motion.
std::vector<LandmarkMatch> match_landmarks(const GeometricHierarchy& query,
                                           const GeometricHierarchy& map, const PolygonMatch& match,
                                           const MatchParameters& parameters = {});

/// All landmark pairs between a query and a map, best first. No landmark is in two pairs: of
/// conflicting pairs the one with the higher score is used. Different matches may imply different
/// motions; the caller must find the common one.
std::vector<LandmarkMatch> match(const GeometricHierarchy& query, const GeometricHierarchy& map,
                                 const MatchParameters& parameters = {});

}  // namespace understory::hierarchy
