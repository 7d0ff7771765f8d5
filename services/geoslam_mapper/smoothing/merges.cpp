#include "services/geoslam_mapper/smoothing/merges.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <tuple>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Squared Mahalanobis distance between two sets of observations (2 degrees of freedom) above which
/// they are of two landmarks. Exceeded by chance once in 3e6.
constexpr double kContradiction = 30.0;
/// Number of separated pairs that are remembered.
constexpr std::size_t kMostSeparated = 256;

/// Mean of a landmark's observations, at the present poses.
class MeanPosition {
 public:
  void add(const geometry::SE2& map_T_node, const Eigen::Vector2d& position_m,
           const Eigen::Matrix2d& information) {
    const Eigen::Matrix2d rotation = map_T_node.rotation();
    const Eigen::Matrix2d weight = rotation * information * rotation.transpose();
    const Eigen::Vector2d position = map_T_node * position_m;
    information_ += weight;
    weighted_ += weight * position;
    squares_ += position.dot(weight * position);
    ++count_;
  }

  bool is_empty() const { return count_ == 0; }
  Eigen::Vector2d mean_m() const { return information_.inverse() * weighted_; }
  Eigen::Matrix2d covariance_m2() const { return information_.inverse(); }
  /// Sum of squared whitened deviations from the mean; 2 (count - 1) degrees of freedom.
  double scatter() const { return std::max(0.0, squares_ - weighted_.dot(mean_m())); }
  int count() const { return count_; }

 private:
  Eigen::Matrix2d information_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted_ = Eigen::Vector2d::Zero();
  double squares_ = 0.0;
  int count_ = 0;
};

}  // namespace

MergedPair Merges::in_order(model::LandmarkId a, model::LandmarkId b, const LandmarkMap& map) {
  const auto rank = [&](model::LandmarkId id, model::LandmarkId other) {
    const StoredLandmark& landmark = map.at(id);
    return std::tuple(landmark.is_given(), landmark.observation_count, other);
  };
  const bool keep_a = rank(a, b) > rank(b, a);
  return keep_a ? MergedPair{b, a} : MergedPair{a, b};
}

void Merges::merge(const MergedPair& pair, bool is_final, GlobalMap& map) {
  auto observed = map.graph.hand_over(pair.first, pair.second, map.landmarks.at(pair.first).nodes);
  if (is_final) {
    join(pair, map);
  } else {
    adopt(pair, std::move(observed), map);
  }
}

void Merges::absorb(const MergedPair& pair, GlobalMap& map) {
  StoredLandmark& old_one = map.landmarks.at(pair.first);
  for (const NodeIndex node : std::exchange(old_one.nodes, {}))
    if (map.graph.node(node).observations().contains(pair.first))
      map.graph.ignore(node, pair.first);
  old_one.information = 0.0;
  (void)map.graph.hand_over(pair.first, pair.second, old_one.nodes);
  join(pair, map);
}

void Merges::adopt(const MergedPair& pair, std::vector<HandedOver> observed, GlobalMap& map) {
  if (merges_.size() == kMost) merges_.erase(merges_.begin());
  StoredLandmark old_one = map.landmarks.at(pair.first);
  join(pair, map);
  merges_.push_back({std::move(old_one), pair.second, std::move(observed)});
}

/// Merges the data of the two in the map, beside the graph.
void Merges::join(const MergedPair& pair, GlobalMap& map) {
  for (Merge& merge : merges_)
    if (merge.into == pair.first) merge.into = pair.second;
  const StoredLandmark& old_one = map.landmarks.at(pair.first);
  StoredLandmark& new_one = map.landmarks.at(pair.second);

  // In order of time as far as it is known: the one observed last has the last nodes.
  const StoredLandmark& older = old_one.last_keyframe < new_one.last_keyframe ? old_one : new_one;
  StoredLandmark joined = older;
  for (const NodeIndex node : (&older == &old_one ? new_one : old_one).nodes)
    joined.observed_from(node);
  new_one.nodes = std::move(joined.nodes);
  for (const float view_m : (&older == &old_one ? new_one : old_one).views_m)
    joined.viewed_at(view_m);
  new_one.views_m = std::move(joined.views_m);
  new_one.information += old_one.information;
  new_one.observation_count += old_one.observation_count;
  new_one.last_keyframe = std::max(new_one.last_keyframe, old_one.last_keyframe);
  map.landmarks.remove(pair.first);
}

bool Merges::were_separated(model::LandmarkId a, model::LandmarkId b) const {
  const MergedPair pair{std::min(a, b), std::max(a, b)};
  return std::find(separated_.begin(), separated_.end(), pair) != separated_.end();
}

/// Separates only the worst one: until the graph is solved, a wrong merge also distorts correct
/// ones around it.
std::optional<model::LandmarkId> Merges::take_back(std::span<const model::Association> touched,
                                                   GlobalMap& map) {
  auto worst = merges_.end();
  double largest = kContradiction;
  for (auto merge = merges_.begin(); merge != merges_.end(); ++merge) {
    const bool is_touched = std::any_of(
        touched.begin(), touched.end(),
        [&](const model::Association& pair) { return pair.landmark_id == merge->into; });
    if (!is_touched || !map.landmarks.all().contains(merge->into)) continue;
    const double one = contradiction(*merge, map);
    if (one <= largest) continue;
    largest = one;
    worst = merge;
  }
  if (worst == merges_.end()) return std::nullopt;

  const Merge merge = std::move(*worst);
  merges_.erase(worst);
  return separate(merge, map);
}

/// Squared Mahalanobis distance between the mean of the old landmark's observations and that of all
/// others, in units of their scatter if that is larger than stated.
double Merges::contradiction(const Merge& merge, const GlobalMap& map) {
  MeanPosition before;
  MeanPosition others;
  for (const NodeIndex node : map.landmarks.at(merge.into).nodes) {
    const auto& observations = map.graph.node(node).observations();
    if (!observations.contains(merge.into)) continue;
    const auto& factor = map.graph.observation(node, merge.into);
    const bool is_old =
        std::any_of(merge.observed.begin(), merge.observed.end(),
                    [&](const HandedOver& one) { return one.node == node && one.counts; });
    (is_old ? before : others).add(map.graph.pose(node), factor.position, factor.information);
  }
  if (before.is_empty() || others.is_empty()) return 0.0;

  const Eigen::Vector2d apart = before.mean_m() - others.mean_m();
  const Eigen::Matrix2d covariance = before.covariance_m2() + others.covariance_m2();
  const int freedom = 2 * (before.count() + others.count() - 2);
  const double scatter =
      freedom > 0 ? (before.scatter() + others.scatter()) / static_cast<double>(freedom) : 1.0;
  return apart.dot(covariance.inverse() * apart) / std::max(1.0, scatter);
}

/// Restores the old landmark with a new id: ids are never reused.
model::LandmarkId Merges::separate(const Merge& merge, GlobalMap& map) {
  StoredLandmark old_one = merge.old_one;
  StoredLandmark& joined = map.landmarks.at(merge.into);
  joined.information = std::max(joined.information - old_one.information, 1e-6);
  joined.observation_count -= std::min(joined.observation_count, old_one.observation_count);

  // Returns the observations.
  MeanPosition position;
  for (const HandedOver& one : merge.observed)
    position.add(map.graph.pose(one.node), one.position_m, one.information);
  old_one.position_m = position.mean_m();
  const model::LandmarkId id = map.landmarks.insert(old_one);
  map.graph.add_landmark(id, old_one.position_m, std::nullopt);
  map.landmarks.at(id).nodes = map.graph.give_back(merge.into, id, merge.observed);
  std::erase_if(joined.nodes, [&](NodeIndex node) {
    return !map.graph.node(node).observations().contains(merge.into);
  });

  // Prevents a second merge of the two.
  if (separated_.size() == kMostSeparated) separated_.erase(separated_.begin());
  separated_.emplace_back(std::min(id, merge.into), std::max(id, merge.into));
  return id;
}

void Merges::hand_over(NodeIndex node) {
  for (Merge& merge : merges_)
    std::erase_if(merge.observed, [&](const HandedOver& one) { return one.node == node; });
  std::erase_if(merges_, [](const Merge& merge) { return merge.observed.empty(); });
}

}  // namespace understory::geoslam_mapper::smoothing
