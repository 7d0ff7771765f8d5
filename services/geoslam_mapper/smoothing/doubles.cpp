#include "services/geoslam_mapper/smoothing/doubles.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Least odds of one landmark against two.
constexpr double kLeastOdds = 30.0;
/// Degrees of freedom of the error's distribution (Student's t): errors of real landmarks have
/// heavy tails.
constexpr double kTail = 4.0;
/// Share of the landmarks that bad scans displace temporarily, and its factor for each further node
/// that observed the landmark.
constexpr double kMoved = 0.05;
constexpr double kMovedAgain = 0.8;
/// Trunks stand in clumps: least density of other trunks next to one [1/m^2]. Between 0.3 and 1 m
/// it is 0.03 to 0.08 in surveyed forests (Longleaf, Lansing, Bei, Waka); 0.02 gave no more wrong
/// merges than 0.05, and more correct ones.
/// The sightings per node distinguish the two as well, so a lower density is sufficient.
constexpr double kLeastDensity = 0.02;
constexpr double kLeastDensityByTurns = 0.01;
/// Largest variance of the distance [m^2, per axis] that resolves the trunks of a clump.
constexpr double kTellsTrunks_m2 = 0.0125;
/// Observations within this path length [m] belong to one way past the landmark.
constexpr double kOneWay_m = 15.0;
/// A landmark or node last seen more than this path length ago [m] belongs to an earlier pass.
constexpr double kEarlierPass_m = 50.0;
constexpr double kNeighbourhood_m = 25.0;
/// Least distance of two trunks, from centre to centre [m].
constexpr double kTouching_m = 0.06;

/// Number of nodes that observed both.
std::ptrdiff_t count_together(const StoredLandmark& a, const StoredLandmark& b) {
  return std::count_if(a.views_m.begin(), a.views_m.end(), [&](float view_m) {
    return std::find(b.views_m.begin(), b.views_m.end(), view_m) != b.views_m.end();
  });
}

/// Whether nodes observed the two side by side. Two separate trunks at this distance are observed
/// together from almost everywhere; a trunk doubled by a bad scan is observed so once.
bool are_observed_together(const StoredLandmark& a, const StoredLandmark& b) {
  const auto common = static_cast<std::size_t>(count_together(a, b));
  return common > 1 || 4 * common > std::min(a.views_m.size(), b.views_m.size());
}

/// Observations of `a` within a short way of one of `b`, from other nodes.
int count_beside(const StoredLandmark& a, const StoredLandmark& b) {
  return static_cast<int>(std::count_if(a.views_m.begin(), a.views_m.end(), [&](double view_m) {
    return std::any_of(b.views_m.begin(), b.views_m.end(), [&](double other_m) {
      return other_m != view_m && std::abs(other_m - view_m) < kOneWay_m;
    });
  }));
}

/// Odds of one trunk against two from the nodes that observed each on one way past them; none if no
/// way observed both. Of nodes that see either of two trunks, each seen by half of them, one in
/// three sees both; a node sees one trunk twice with probability 1/20 (a scan that doubles it). A
/// few alternating sightings happen by chance; if one was seen only once, many sightings of the
/// other are weak evidence.
std::optional<double> odds_by_turns(const StoredLandmark& a, const StoredLandmark& b) {
  constexpr double kAlone = (1.0 - 0.05) / (1.0 - 1.0 / 3.0);
  constexpr double kTogether = 0.05 / (1.0 / 3.0);
  constexpr int kOnce = 3;
  const int of_a = count_beside(a, b);
  const int of_b = count_beside(b, a);
  const int alone = std::min(of_a, of_b) > 1 ? of_a + of_b : std::min(of_a + of_b, kOnce);
  if (alone == 0) return std::nullopt;
  return std::pow(kAlone, alone) * std::pow(kTogether, count_together(a, b));
}

/// Statistics of the landmarks around a pair.
struct Neighbourhood {
  double density_per_m2 = 0.0;
  /// Odds that each of two passes missed the other's landmark, against both passes seeing it.
  double missing_odds = 1.0;
};

/// Counts the landmarks that were observed on this pass, on earlier ones, and on both.
Neighbourhood neighbourhood_of(const Eigen::Vector2d& position_m, const GlobalMap& map) {
  const double limit_m = map.graph.node(*map.graph.newest()).along_m - kEarlierPass_m;
  double all = 0.0;
  double both = 0.0;
  map.landmarks.index().for_each_within(
      position_m, kNeighbourhood_m, [&](model::LandmarkId id, const Eigen::Vector2d&, double) {
        const StoredLandmark& landmark = map.landmarks.at(id);
        const std::vector<NodeIndex>& nodes = landmark.nodes;
        const auto is_earlier = [&](NodeIndex node) {
          return map.graph.node(node).along_m < limit_m;
        };
        const bool some =
            landmark.is_given() || std::any_of(nodes.begin(), nodes.end(), is_earlier);
        all += 1.0;
        both += some && !std::all_of(nodes.begin(), nodes.end(), is_earlier) ? 1.0 : 0.0;
      });

  // If each pass sees a share q, q / (2 - q) of the landmarks seen by either are seen by both.
  const double shared = (both + 0.5) / (all + 1.0);
  const double seen = 2.0 * shared / (1.0 + shared);
  const double missing = (1.0 - seen) / seen;
  return {all / (std::numbers::pi * kNeighbourhood_m * kNeighbourhood_m), missing * missing};
}

/// Density [1/m^2] of the distance of two landmarks that are one trunk.
double density_of_one(const Eigen::Vector2d& apart_m, const Eigen::Matrix2d& covariance_m2) {
  const double squared = apart_m.dot(covariance_m2.inverse() * apart_m);
  return std::pow(1.0 + squared / kTail, -0.5 * (kTail + 2.0)) /
         (2.0 * std::numbers::pi * std::sqrt(covariance_m2.determinant()));
}

/// Largest distance of a single observation from its landmark for association [m].
double gate_of_one_m(const StoredLandmark& landmark, const SmoothingMapperParameters& parameters) {
  const double views = static_cast<double>(std::max<std::size_t>(1, landmark.views_m.size()));
  return parameters.gate_sigmas * std::sqrt(views / landmark.information) + parameters.gate_floor_m;
}

/// Share of the landmarks with this number of nodes that bad scans displaced.
double chance_of_moved(std::size_t nodes) {
  return kMoved * std::pow(kMovedAgain, static_cast<double>(nodes) - 1.0);
}

/// Likewise for two landmarks of one way: a share `moved` was displaced by bad scans, uniformly
/// within the search distance for doubles; the others have the stated errors.
double density_of_moved(const Eigen::Vector2d& apart_m, const Eigen::Matrix2d& covariance_m2,
                        double moved, double merge_distance_m) {
  const double squared = apart_m.dot(covariance_m2.inverse() * apart_m);
  const double stated =
      std::exp(-0.5 * squared) / (2.0 * std::numbers::pi * std::sqrt(covariance_m2.determinant()));
  return stated + moved / (std::numbers::pi * merge_distance_m * merge_distance_m);
}

/// Whether a third landmark, different from one of the two, lies in the same place.
bool has_rival(const StoredLandmark& a, const StoredLandmark& b, double radius_m,
               const LandmarkMap& landmarks) {
  bool result = false;
  landmarks.index().for_each_within(0.5 * (a.position_m + b.position_m), radius_m,
                                    [&](model::LandmarkId id, const Eigen::Vector2d&, double) {
                                      if (id == a.id || id == b.id || result) return;
                                      const StoredLandmark& third = landmarks.at(id);
                                      result = are_observed_together(third, a) ||
                                               are_observed_together(third, b);
                                    });
  return result;
}

enum class Sameness {
  kTwo,
  kOneByPlace,
  kOne,
  kOneNoPoint,  ///< One object that was observed as two points.
};

Sameness sameness(const StoredLandmark& a, const StoredLandmark& b,
                  const SmoothingMapperParameters& parameters, const GlobalMap& map) {
  const Eigen::Vector2d apart = a.position_m - b.position_m;
  const bool touch = apart.norm() < std::max({kTouching_m, a.radius_m, b.radius_m});
  if (!touch && are_observed_together(a, b)) return Sameness::kTwo;

  // Their distance, and whether its covariance resolves neighbours.
  const auto covariance = map.graph.difference_covariance(a.id, b.id);
  if (!covariance) return Sameness::kTwo;
  const double gate_m =
      parameters.gate_sigmas * std::sqrt(0.5 * covariance->trace()) + parameters.gate_floor_m;
  if (gate_m > parameters.merge_distance_m || has_rival(a, b, gate_m, map.landmarks))
    return Sameness::kTwo;

  // Never seen on one way: each pass missed one of two trunks, if there are two.
  if (touch) {
    const double squared = apart.dot(covariance->inverse() * apart);
    return squared > parameters.outlier_chi2 ? Sameness::kOneNoPoint : Sameness::kOne;
  }
  const double floor_m = parameters.gate_floor_m / parameters.gate_sigmas;
  const Eigen::Matrix2d spread = *covariance + floor_m * floor_m * Eigen::Matrix2d::Identity();
  const Neighbourhood around = neighbourhood_of(a.position_m, map);
  const double two_by_place = std::max(kLeastDensity, around.density_per_m2) * around.missing_odds;
  const bool tells_trunks = 0.5 * covariance->trace() <= kTellsTrunks_m2;
  if (tells_trunks && apart.norm() <= gate_m &&
      density_of_one(apart, spread) >= kLeastOdds * two_by_place)
    return Sameness::kOneByPlace;

  // Seen on one way: no pass missed a trunk.
  const auto turns = odds_by_turns(a, b);
  if (!turns) return Sameness::kTwo;
  // Within the gate, detections of one are sometimes associated with the other: no sign of bad
  // scans.
  const std::size_t fewest = std::min(a.views_m.size(), b.views_m.size());
  const double gate_m_of_one = std::max(gate_of_one_m(a, parameters), gate_of_one_m(b, parameters));
  const double moved = apart.norm() > gate_m_of_one ? chance_of_moved(fewest) : 0.0;
  const double one = *turns * density_of_moved(apart, spread, moved, parameters.merge_distance_m);
  const double two = std::max(kLeastDensityByTurns, around.density_per_m2);
  return one >= kLeastOdds * two ? Sameness::kOne : Sameness::kTwo;
}

/// A landmark that is the same as this one.
struct Double {
  model::LandmarkId id = 0;
  Sameness how = Sameness::kTwo;
};
std::optional<Double> double_of(const StoredLandmark& landmark,
                                const SmoothingMapperParameters& parameters, const Merges& merges,
                                const GlobalMap& map) {
  if (!map.graph.position(landmark.id)) return std::nullopt;
  for (const model::LandmarkId other_id : map.landmarks.index().near(
           {landmark.position_m, parameters.merge_distance_m + 2.0 * LandmarkMap::kStaleness_m})) {
    if (other_id == landmark.id) continue;
    const StoredLandmark& other = map.landmarks.at(other_id);
    const double distance_m = (other.position_m - landmark.position_m).norm();
    if (distance_m > parameters.merge_distance_m || landmark.kind != other.kind ||
        !map.graph.position(other_id) || merges.were_separated(landmark.id, other_id)) {
      continue;
    }
    const Sameness same = sameness(landmark, other, parameters, map);
    if (same != Sameness::kTwo) return Double{other_id, same};
  }
  return std::nullopt;
}

}  // namespace

std::vector<MergedPair> merge_doubles(std::span<const model::LandmarkId> ids,
                                      const SmoothingMapperParameters& parameters, Merges& merges,
                                      GlobalMap& map) {
  std::vector<MergedPair> merged;
  for (const model::LandmarkId id : ids) {
    if (!map.landmarks.all().contains(id)) continue;
    const auto other = double_of(map.landmarks.at(id), parameters, merges, map);
    if (!other) continue;

    merged.push_back(Merges::in_order(id, other->id, map.landmarks));
    if (other->how == Sameness::kOneNoPoint) {
      merges.absorb(merged.back(), map);
    } else {
      merges.merge(merged.back(), other->how == Sameness::kOne, map);
    }
  }
  return merged;
}

}  // namespace understory::geoslam_mapper::smoothing
