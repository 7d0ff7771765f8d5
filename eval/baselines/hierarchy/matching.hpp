// Matching two baseline hierarchies (GeoSLAM §3.2.3).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "eval/baselines/hierarchy/hierarchy.hpp"

namespace understory::eval::baselines::hierarchy {

/// Thresholds of matching; symbols as in GeoSLAM §3.2.3.
struct MatchingParameters {
  double max_descriptor_distance = 9.0;   ///< [tau]
  int max_side_difference = 3;            ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;  ///< [eta] Of the triangles of the smaller polygon.
};

/// Landmark `local` of the first hierarchy is landmark `other` of the second.
struct PointMatch {
  std::uint32_t local = 0;
  std::uint32_t other = 0;
};

/// All elements of two hierarchies that are each other's nearest below the largest tau. Which of
/// them a smaller tau accepts needs no new search.
class HierarchyMatches {
 public:
  /// Both hierarchies must outlive this object.
  HierarchyMatches(const Hierarchy& local, const Hierarchy& other,
                   const MatchingParameters& parameters);

  /// Landmark pairs with threshold `max_descriptor_distance` [tau] <= the constructor's.
  std::vector<PointMatch> points(double max_descriptor_distance) const;
  /// Numbers of the matched polygons, in both hierarchies.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> polygons() const;

 private:
  struct Match {
    std::uint32_t local = 0;
    std::uint32_t other = 0;
    double distance = 0.0;
  };
  struct PolygonMatch {
    Match polygon;
    std::vector<Match> triangles;  ///< Mutual nearest inside the two polygons.
    double triangles_needed = 0.0;
  };

  std::vector<Match> match_triangles(const Polygon& local, const Polygon& other, double tau) const;

  const Hierarchy* local_;
  const Hierarchy* other_;
  std::vector<PolygonMatch> matches_;
};

/// Landmark pairs of `local` and `other` for one threshold.
std::vector<PointMatch> match_hierarchies(const Hierarchy& local, const Hierarchy& other,
                                          const MatchingParameters& parameters);

}  // namespace understory::eval::baselines::hierarchy
