#include "common/hierarchy/matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <unordered_set>

#include "common/geometry/alignment.hpp"

namespace understory::hierarchy {
namespace {

/// Landmark slots: query, map.
using SlotPair = std::pair<std::uint32_t, std::uint32_t>;

/// Weight of a match at the border of the view: from another viewpoint such a polygon is often
/// different.
constexpr double kHullTrust = 0.5;

const DescriptorIndex::Hit* nearest_of_like_size(const GeometricHierarchy& hierarchy,
                                                 const std::vector<DescriptorIndex::Hit>& hits,
                                                 std::size_t sides, int max_side_difference) {
  for (const DescriptorIndex::Hit& hit : hits) {
    const auto other = hierarchy.polygons()[hit.key].boundary.size();
    if (std::abs(static_cast<int>(other) - static_cast<int>(sides)) <= max_side_difference) {
      return &hit;
    }
  }
  return nullptr;
}

/// A triangle by its sides: lengths_m[i] lies opposite slots[i].
struct TriangleShape {
  std::array<std::uint32_t, 3> slots;
  std::array<double, 3> lengths_m;
};

std::vector<TriangleShape> shapes_of(const Triangulation& triangulation, const Polygon& polygon) {
  std::vector<TriangleShape> shapes;
  shapes.reserve(polygon.triangles.size());
  for (const std::uint32_t index : polygon.triangles) {
    TriangleShape& shape = shapes.emplace_back();
    shape.slots = triangulation.triangles()[index].vertices;
    for (std::size_t i = 0; i < 3; ++i) {
      shape.lengths_m[i] = (triangulation.position(shape.slots[(i + 1) % 3]) -
                            triangulation.position(shape.slots[(i + 2) % 3]))
                               .norm();
    }
  }
  return shapes;
}

/// Best fit of two triangles: vertex i of the first on vertex i + shift of the second.
struct Fit {
  double cost = std::numeric_limits<double>::infinity();
  std::size_t shift = 0;
};

/// Only the three cyclic shifts, not the six permutations: the others are mirror images.
Fit fit(const TriangleShape& a, const TriangleShape& b, double max_edge_difference_m) {
  Fit best;
  for (std::size_t shift = 0; shift < 3; ++shift) {
    double cost = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double difference = std::abs(a.lengths_m[i] - b.lengths_m[(i + shift) % 3]);
      cost += difference <= max_edge_difference_m ? difference * difference
                                                  : std::numeric_limits<double>::infinity();
    }
    if (cost < best.cost) {
      best = {cost, shift};
    }
  }

  return best;
}

/// Votes for vertex pairs from mutually best triangles; empty if too few triangles have a partner.
std::map<SlotPair, int> vote(const std::vector<TriangleShape>& a,
                             const std::vector<TriangleShape>& b,
                             const MatchParameters& parameters) {
  std::vector<std::vector<Fit>> fits(a.size(), std::vector<Fit>(b.size()));
  std::vector<double> best_of_a(a.size(), std::numeric_limits<double>::infinity());
  std::vector<double> best_of_b(b.size(), std::numeric_limits<double>::infinity());

  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      fits[i][j] = fit(a[i], b[j], parameters.max_edge_difference_m);
      best_of_a[i] = std::min(best_of_a[i], fits[i][j].cost);
      best_of_b[j] = std::min(best_of_b[j], fits[i][j].cost);
    }
  }

  std::map<SlotPair, int> votes;
  std::size_t matched = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const Fit& f = fits[i][j];
      if (std::isfinite(f.cost) && f.cost == best_of_a[i] && f.cost == best_of_b[j]) {
        ++matched;
        for (std::size_t v = 0; v < 3; ++v) {
          ++votes[{a[i].slots[v], b[j].slots[(v + f.shift) % 3]}];
        }
      }
    }
  }

  const double required =
      parameters.min_triangle_match_ratio * static_cast<double>(std::min(a.size(), b.size()));
  return static_cast<double>(matched) < required ? std::map<SlotPair, int>{} : votes;
}

/// Takes pairs in the given order if neither side is taken already.
std::vector<SlotPair> one_to_one(const std::vector<SlotPair>& ordered) {
  std::vector<SlotPair> result;
  for (const SlotPair& pair : ordered) {
    if (std::none_of(result.begin(), result.end(), [&](const SlotPair& taken) {
          return taken.first == pair.first || taken.second == pair.second;
        })) {
      result.push_back(pair);
    }
  }
  return result;
}

/// Aligns the query's polygon with the map's and finds their coincident landmarks.
class PolygonAlignment {
 public:
  PolygonAlignment(const Triangulation& query, const Triangulation& map, double max_residual_m)
      : query_(query), map_(map), max_residual_m_(max_residual_m) {}

  /// Drops the worst pair until the others agree with one motion; none if fewer than three remain.
  std::optional<geometry::SE2> agree(std::vector<SlotPair> pairs) const {
    while (pairs.size() >= 3) {
      const geometry::SE2 map_T_query = align(pairs);
      const auto worst =
          std::max_element(pairs.begin(), pairs.end(), [&](const SlotPair& p, const SlotPair& q) {
            return residual(map_T_query, p) < residual(map_T_query, q);
          });
      if (residual(map_T_query, *worst) <= max_residual_m_) {
        return map_T_query;
      }
      pairs.erase(worst);
    }
    return std::nullopt;
  }

  /// Pairs of landmarks of the two boundaries that coincide, closest first.
  std::vector<SlotPair> coincident(const geometry::SE2& map_T_query, const Polygon& query,
                                   const Polygon& map) const {
    std::vector<std::pair<double, SlotPair>> near;
    for (const std::uint32_t q : query.boundary) {
      for (const std::uint32_t m : map.boundary) {
        const double distance = residual(map_T_query, {q, m});
        if (distance <= max_residual_m_) {
          near.push_back({distance, {q, m}});
        }
      }
    }

    std::sort(near.begin(), near.end());
    std::vector<SlotPair> ordered;
    ordered.reserve(near.size());

    for (const auto& candidate : near) {
      ordered.push_back(candidate.second);
    }

    return one_to_one(ordered);
  }

 private:
  geometry::SE2 align(const std::vector<SlotPair>& pairs) const {
    geometry::RigidAlignment2 alignment;
    for (const auto& [q, m] : pairs) {
      alignment.add(map_.position(m), query_.position(q));
    }
    return alignment.a_T_b();
  }
  double residual(const geometry::SE2& map_T_query, const SlotPair& pair) const {
    return (map_T_query * query_.position(pair.first) - map_.position(pair.second)).norm();
  }

  const Triangulation& query_;
  const Triangulation& map_;
  double max_residual_m_;
};

}  // namespace

std::vector<PolygonMatch> match_polygons(const GeometricHierarchy& query,
                                         const GeometricHierarchy& map,
                                         const MatchParameters& parameters) {
  std::vector<PolygonMatch> result;
  std::vector<DescriptorIndex::Hit> hits;
  for (std::uint32_t q = 0; q < query.polygons().size(); ++q) {
    const Polygon& polygon = query.polygons()[q];
    if (!polygon.exists()) {
      continue;
    }

    map.index().within(polygon.descriptor, static_cast<float>(parameters.max_descriptor_distance),
                       hits);
    const auto* there =
        nearest_of_like_size(map, hits, polygon.boundary.size(), parameters.max_side_difference);
    if (there == nullptr) {
      continue;
    }

    const PolygonMatch match{q, there->key, there->distance};
    const Polygon& partner = map.polygons()[match.map];
    query.index().within(partner.descriptor, match.distance, hits);
    const auto* back =
        nearest_of_like_size(query, hits, partner.boundary.size(), parameters.max_side_difference);

    if (back != nullptr && back->key == q) {
      result.push_back(match);
    }
  }

  return result;
}

std::vector<LandmarkMatch> match_landmarks(const GeometricHierarchy& query,
                                           const GeometricHierarchy& map, const PolygonMatch& match,
                                           const MatchParameters& parameters) {
  const Polygon& here = query.polygons()[match.query];
  const Polygon& there = map.polygons()[match.map];
  const auto votes = vote(shapes_of(query.triangulation(), here),
                          shapes_of(map.triangulation(), there), parameters);
  std::vector<SlotPair> ordered;
  ordered.reserve(votes.size());

  for (const auto& [pair, count] : votes) {
    ordered.push_back(pair);
  }

  std::stable_sort(ordered.begin(), ordered.end(),
                   [&](const SlotPair& a, const SlotPair& b) { return votes.at(a) > votes.at(b); });
  const PolygonAlignment alignment(query.triangulation(), map.triangulation(),
                                   parameters.max_residual_m);
  const auto map_T_query = alignment.agree(one_to_one(ordered));

  if (!map_T_query) {
    return {};
  }

  const auto pairs = alignment.coincident(*map_T_query, here, there);
  if (pairs.size() < 3) {
    return {};
  }

  const double closeness = match.distance / parameters.max_descriptor_distance;
  const double score = (static_cast<double>(pairs.size()) - 2.0) *
                       std::exp(-0.5 * closeness * closeness) *
                       (here.touches_hull() || there.touches_hull() ? kHullTrust : 1.0);
  std::vector<LandmarkMatch> result;
  result.reserve(pairs.size());

  for (const auto& [q, m] : pairs) {
    result.push_back({query.triangulation().id(q), map.triangulation().id(m), score});
  }

  return result;
}

std::vector<LandmarkMatch> match(const GeometricHierarchy& query, const GeometricHierarchy& map,
                                 const MatchParameters& parameters) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, double> scores;
  for (const PolygonMatch& polygons : match_polygons(query, map, parameters)) {
    for (const LandmarkMatch& pair : match_landmarks(query, map, polygons, parameters)) {
      scores[{pair.query_id, pair.map_id}] += pair.score;
    }
  }

  std::vector<LandmarkMatch> ordered;
  ordered.reserve(scores.size());
  for (const auto& [ids, score] : scores) {
    ordered.push_back({ids.first, ids.second, score});
  }

  std::stable_sort(
      ordered.begin(), ordered.end(),
      [](const LandmarkMatch& a, const LandmarkMatch& b) { return a.score > b.score; });
  std::vector<LandmarkMatch> result;
  std::unordered_set<std::uint64_t> query_taken;
  std::unordered_set<std::uint64_t> map_taken;

  for (const LandmarkMatch& pair : ordered) {
    if (!query_taken.contains(pair.query_id) && !map_taken.contains(pair.map_id)) {
      query_taken.insert(pair.query_id);
      map_taken.insert(pair.map_id);
      result.push_back(pair);
    }
  }

  return result;
}

}  // namespace understory::hierarchy
