#include "common/map_file/difference.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <map>

namespace understory::map_file {
namespace {

Eigen::Matrix2d covariance_of(const model::MapLandmark& landmark, double unknown_sigma_m) {
  if (!landmark.covariance_m2.isZero(0.0)) return landmark.covariance_m2;
  return unknown_sigma_m * unknown_sigma_m * Eigen::Matrix2d::Identity();
}

MovedLandmark move_of(const model::MapLandmark& before, const model::MapLandmark& after,
                      double unknown_sigma_m) {
  const Eigen::Vector2d way = after.position_m - before.position_m;
  const Eigen::Matrix2d covariance =
      covariance_of(before, unknown_sigma_m) + covariance_of(after, unknown_sigma_m);
  MovedLandmark move{after.id, way.norm(), 0.0};
  if (move.distance_m == 0.0) return move;

  const bool is_regular = covariance.determinant() > 0.0;
  move.chi2 =
      is_regular ? way.dot(covariance.inverse() * way) : std::numeric_limits<double>::infinity();
  return move;
}

using LandmarkUse = std::map<model::LandmarkId, bool>;

/// Whether each landmark with a state of existence is in use.
LandmarkUse use_in(const StoredMap& map) {
  LandmarkUse use;
  if (!map.existence) return use;
  for (const ExistenceRow& row : map.existence->landmarks)
    use.emplace_hint(use.end(), row.existence.id, row.existence.is_in_use);
  return use;
}

bool is_in_use(const LandmarkUse& use, model::LandmarkId id) {
  const auto found = use.find(id);
  return found == use.end() || found->second;
}

bool is_told(const ExistenceChange& change, double least_change) {
  if (change.was_in_use != change.is_in_use) return true;
  return change.probability_before && change.probability_after &&
         std::abs(*change.probability_after - *change.probability_before) > least_change;
}

}  // namespace

double chi2_of_quantile(double quantile) { return -2.0 * std::log1p(-quantile); }

MapDifference difference(const StoredMap& before, const StoredMap& after,
                         const DifferenceLimits& limits) {
  MapDifference result;
  const double limit = chi2_of_quantile(limits.quantile);
  const LandmarkUse used_before = use_in(before);
  const LandmarkUse used_after = use_in(after);
  auto old = before.landmarks.begin();
  const auto end = before.landmarks.end();

  for (const StoredLandmark& one : after.landmarks) {
    for (; old != end && old->landmark.id < one.landmark.id; ++old)
      result.removed.push_back(old->landmark.id);
    if (old == end || old->landmark.id != one.landmark.id) {
      result.added.push_back(one.landmark.id);
      continue;
    }

    const MovedLandmark move = move_of(old->landmark, one.landmark, limits.unknown_sigma_m);
    if (move.chi2 > limit) {
      result.moved.push_back(move);
    } else {
      ++result.kept;
    }
    const model::LandmarkId id = one.landmark.id;
    const ExistenceChange change{id, is_in_use(used_before, id), is_in_use(used_after, id),
                                 old->existence, one.existence};
    if (is_told(change, limits.probability_change)) result.existence.push_back(change);
    ++old;
  }

  for (; old != end; ++old) result.removed.push_back(old->landmark.id);
  return result;
}

}  // namespace understory::map_file
