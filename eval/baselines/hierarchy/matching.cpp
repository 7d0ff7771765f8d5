#include "eval/baselines/hierarchy/matching.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>
#include <utility>

namespace understory::eval::baselines::hierarchy {
namespace {

struct Nearest {
  std::uint32_t number = 0;
  double distance = 0.0;
};

/// The polygon of `candidates` nearest to `polygon` below `max_distance`. Walks outwards in the
/// order of descriptor(0): exact, since a distance is never less than the difference of one
/// element.
std::optional<Nearest> nearest_polygon(const Polygon& polygon, const Hierarchy& candidates,
                                       int max_side_difference, double max_distance) {
  const auto order = candidates.by_mean_radius();
  const auto polygons = candidates.polygons();
  const double key = polygon.descriptor(0);
  const auto above_start = std::lower_bound(
      order.begin(), order.end(), key,
      [&](std::uint32_t number, double value) { return polygons[number].descriptor(0) < value; });
  auto above = static_cast<std::size_t>(std::distance(order.begin(), above_start));
  std::size_t below = above;
  std::optional<Nearest> best;

  double limit = max_distance;
  while (true) {
    const double gap_above =
        above < order.size() ? polygons[order[above]].descriptor(0) - key : limit;
    const double gap_below = below > 0 ? key - polygons[order[below - 1]].descriptor(0) : limit;
    if (gap_above >= limit && gap_below >= limit) {
      return best;
    }

    const std::uint32_t number = gap_above <= gap_below ? order[above++] : order[--below];
    const Polygon& candidate = polygons[number];
    const auto sides = static_cast<int>(polygon.vertices.size());

    if (std::abs(sides - static_cast<int>(candidate.vertices.size())) > max_side_difference) {
      continue;
    }

    const double distance = (polygon.descriptor - candidate.descriptor).norm();
    if (distance < limit) {
      limit = distance;
      best = Nearest{number, distance};
    }
  }
}

/// For each edge of `local` the edge of `other`, by the permutation with least squared difference
/// of lengths. Mirror images are accepted, as in the published code.
std::array<std::size_t, 3> match_edges(const Triangle& local, const Triangle& other) {
  constexpr std::array<std::array<std::size_t, 3>, 6> kPermutations{
      {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}, {1, 0, 2}, {2, 0, 1}, {2, 1, 0}}};
  std::array<std::size_t, 3> best = kPermutations.front();
  double least = -1.0;

  for (const auto& permutation : kPermutations) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double difference = local.edge_lengths_m[i] - other.edge_lengths_m[permutation[i]];
      sum += difference * difference;
    }
    if (least < 0.0 || sum < least) {
      least = sum;
      best = permutation;
    }
  }

  return best;
}

}  // namespace

HierarchyMatches::HierarchyMatches(const Hierarchy& local, const Hierarchy& other,
                                   const MatchingParameters& parameters)
    : local_(&local), other_(&other) {
  const double tau = parameters.max_descriptor_distance;
  const int sides = parameters.max_side_difference;
  for (std::uint32_t l = 0; l < local.polygons().size(); ++l) {
    const Polygon& mine = local.polygons()[l];
    const auto forth = nearest_polygon(mine, other, sides, tau);
    if (!forth) {
      continue;
    }

    const Polygon& theirs = other.polygons()[forth->number];
    const auto back = nearest_polygon(theirs, local, sides, tau);
    if (!back || back->number != l) {
      continue;
    }

    PolygonMatch match;
    match.polygon = {l, forth->number, forth->distance};
    match.triangles = match_triangles(mine, theirs, tau);
    match.triangles_needed =
        parameters.min_triangle_match_ratio * static_cast<double>(mine.triangles.size());
    matches_.push_back(std::move(match));
  }
}

std::vector<HierarchyMatches::Match> HierarchyMatches::match_triangles(const Polygon& local,
                                                                       const Polygon& other,
                                                                       double tau) const {
  std::vector<Nearest> nearest_local(other.triangles.size(), Nearest{0, tau});
  std::vector<Nearest> nearest_other(local.triangles.size(), Nearest{0, tau});
  for (std::uint32_t l = 0; l < local.triangles.size(); ++l) {
    const Descriptor& mine = local_->triangles()[local.triangles[l]].descriptor;
    for (std::uint32_t o = 0; o < other.triangles.size(); ++o) {
      const double distance = (mine - other_->triangles()[other.triangles[o]].descriptor).norm();
      if (distance < nearest_other[l].distance) {
        nearest_other[l] = {o, distance};
      }
      if (distance < nearest_local[o].distance) {
        nearest_local[o] = {l, distance};
      }
    }
  }

  std::vector<Match> matches;
  for (std::uint32_t l = 0; l < local.triangles.size(); ++l) {
    const Nearest& forth = nearest_other[l];
    if (forth.distance < tau && nearest_local[forth.number].number == l) {
      matches.push_back({local.triangles[l], other.triangles[forth.number], forth.distance});
    }
  }

  return matches;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> HierarchyMatches::polygons() const {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const PolygonMatch& match : matches_) {
    pairs.emplace_back(match.polygon.local, match.polygon.other);
  }
  return pairs;
}

std::vector<PointMatch> HierarchyMatches::points(double max_descriptor_distance) const {
  std::vector<PointMatch> pairs;

  // The published code's filter of duplicates orders each pair, although the two numbers count
  // different things: 3 -> 7 hides a true 7 -> 3.
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (const PolygonMatch& match : matches_) {
    if (match.polygon.distance >= max_descriptor_distance) {
      continue;
    }

    const auto accepted = std::count_if(
        match.triangles.begin(), match.triangles.end(),
        [&](const Match& triangle) { return triangle.distance < max_descriptor_distance; });
    if (static_cast<double>(accepted) < match.triangles_needed) {
      continue;
    }

    for (const Match& triangle : match.triangles) {
      if (triangle.distance >= max_descriptor_distance) {
        continue;
      }

      const Triangle& mine = local_->triangles()[triangle.local];
      const Triangle& theirs = other_->triangles()[triangle.other];
      const std::array<std::size_t, 3> edges = match_edges(mine, theirs);

      for (std::size_t i = 0; i < 3; ++i) {
        const PointMatch pair{mine.vertices[(i + 2) % 3], theirs.vertices[(edges[i] + 2) % 3]};
        if (seen.insert(std::minmax(pair.local, pair.other)).second) {
          pairs.push_back(pair);
        }
      }
    }
  }

  return pairs;
}

std::vector<PointMatch> match_hierarchies(const Hierarchy& local, const Hierarchy& other,
                                          const MatchingParameters& parameters) {
  return HierarchyMatches(local, other, parameters).points(parameters.max_descriptor_distance);
}

}  // namespace understory::eval::baselines::hierarchy
