#include "services/geoslam_mapper/smoothing/rejoining.hpp"

#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Path length [m] between searches.
constexpr double kBetweenTries_m = 3.0;
/// Two keyframes agree if their relative poses of the maps differ by less than this, around the
/// vehicle.
constexpr double kAgree_m = 0.5;
constexpr double kAgree_rad = 0.03;
/// Number of localised keyframes that are remembered.
constexpr std::size_t kMostFound = 12;
/// Fewest landmarks in both maps.
constexpr std::size_t kLeastOverlap = 6;

/// Distance between two relative poses of the maps, at a point.
bool agree(const geometry::SE2& a, const geometry::SE2& b, const Eigen::Vector2d& here_m) {
  const geometry::SE2 between = a * b.inverse();
  return (between * here_m - here_m).norm() <= kAgree_m && std::abs(between.theta()) <= kAgree_rad;
}

}  // namespace

std::optional<Overlap> Rejoining::follow(const model::Keyframe& keyframe,
                                         std::span<const model::Association> associations,
                                         const GlobalMap& map, const MapArchive& left) {
  if (left.maps().empty() || !map.graph.newest()) return std::nullopt;
  const double along_m = map.graph.node(*map.graph.newest()).along_m;
  if (std::abs(along_m - tried_m_) < kBetweenTries_m) return std::nullopt;
  tried_m_ = along_m;

  const geometry::SE2 map_T_centre =
      map.trajectory.pose(map.trajectory.last(), map.graph) * keyframe.centre_T_base().inverse();
  for (const KeptMap& one : left.maps()) {
    if (one.whole.empty()) continue;
    auto found = find(keyframe, map_T_centre, associations, one);
    if (!found) continue;
    if (found_.size() == kMostFound) found_.erase(found_.begin());
    found_.push_back(*std::move(found));
    if (auto proven = overlap(map_T_centre.translation())) return proven;
  }
  return std::nullopt;
}

std::optional<Rejoining::Found> Rejoining::find(const model::Keyframe& keyframe,
                                                const geometry::SE2& map_T_centre,
                                                std::span<const model::Association> associations,
                                                const KeptMap& left) {
  const auto [entry, is_new] = index_.try_emplace(left.id);
  if (is_new) {
    for (const model::MapLandmark& landmark : left.landmarks)
      entry->second.insert(landmark.id, landmark.position_m);
  }

  std::vector<constellation::ObservedPoint> points;
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks)
    points.push_back({landmark.position_m, std::sqrt(0.5 * landmark.covariance_m2.trace())});
  const constellation::Localisation place = entry->second.localise(points);
  if (!place.found()) return std::nullopt;

  Found found{left.id, map_T_centre * place.map_T_sensor.inverse(), {}};
  for (const constellation::PointAssociation& theirs : place.associations) {
    const auto ours =
        std::ranges::find(associations, theirs.observed, &model::Association::keyframe_landmark);
    if (ours != associations.end()) found.pairs.emplace_back(ours->landmark_id, theirs.landmark_id);
  }
  return found;
}

/// Uses the earlier map of the latest keyframe found.
std::optional<Overlap> Rejoining::overlap(const Eigen::Vector2d& here_m) const {
  const Found& last = found_.back();
  Overlap overlap{last.map_id, last.map_T_left, {}};
  std::size_t agreeing = 0;
  for (const Found& one : found_) {
    if (one.map_id != last.map_id || !agree(one.map_T_left, last.map_T_left, here_m)) continue;
    ++agreeing;
    overlap.pairs.insert(overlap.pairs.end(), one.pairs.begin(), one.pairs.end());
  }
  if (agreeing < kAgree) return std::nullopt;

  // One partner per landmark; landmarks with several are left to the merging of doubles.
  std::vector<MergedPair>& pairs = overlap.pairs;
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const std::vector<MergedPair> all = pairs;
  std::erase_if(pairs, [&](const MergedPair& pair) {
    return std::count_if(all.begin(), all.end(), [&](const MergedPair& other) {
             return other.first == pair.first || other.second == pair.second;
           }) > 1;
  });
  if (pairs.size() < kLeastOverlap) return std::nullopt;
  return overlap;
}

}  // namespace understory::geoslam_mapper::smoothing
