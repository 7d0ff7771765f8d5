#include "services/geoslam_mapper/smoothing/submaps.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/earlier_pass.hpp"
#include "services/geoslam_mapper/smoothing/submap_content.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Path length [m] between searches for near and distant submaps.
constexpr double kBetweenLooks_m = 10.0;
/// Largest distance of a submap's landmarks from its node [m], beside the sensor's range.
constexpr double kExtent_m = 40.0;
/// Hysteresis between loading and handing over [m].
constexpr double kHysteresis_m = 60.0;
/// Distance beyond the loading distance at which nodes are frozen [m], and the number frozen at a
/// time; nodes thaw before the vehicle is nearer than the third distance beyond it.
constexpr double kFrozenBeyond_m = 500.0;
constexpr double kThawedBeyond_m = 150.0;
constexpr std::size_t kFrozenTogether = 20;
/// Most submaps requested at a time.
constexpr std::size_t kMostWanted = 4;

/// Joint information of all observers, in the frame of a node.
Eigen::Matrix2d information_in(NodeIndex node, std::span<const DormantObservation> observed,
                               const PoseGraph& graph) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  const geometry::SE2 node_T_map = graph.pose(node).inverse();
  for (const DormantObservation& one : observed) {
    const Eigen::Matrix2d rotation = (node_T_map * graph.pose(one.node)).rotation();
    sum += rotation * one.information * rotation.transpose();
  }
  return sum;
}

double sigma_of(NodeIndex node, const PoseGraph& graph) {
  const Eigen::Matrix2d covariance = graph.marginal(node).covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, covariance.trace()));
}

}  // namespace

bool Submaps::follow(const model::FieldOfView& field_of_view, NodeIndex newest, model::Utime utime,
                     GlobalMap& map) {
  if (hand_over_m_ <= 0.0) return false;
  const double along_m = map.graph.node(newest).along_m;
  if (std::abs(along_m - looked_m_) >= kBetweenLooks_m) {
    looked_m_ = along_m;
    if (look_around(field_of_view, newest, map)) return true;
  }
  return ask_for_next() || give_next_away(newest, utime, map);
}

/// Finds near submaps and sets the hand-over distance. True if it solved the graph.
bool Submaps::look_around(const model::FieldOfView& field_of_view, NodeIndex newest,
                          GlobalMap& map) {
  const Eigen::Vector2d vehicle_m = map.graph.pose(newest).translation();
  // Search range of PassJoiner for earlier passes, plus the sensor range there.
  const double range_m = field_of_view.max_range_m;
  const double reach_m =
      std::min(kFurthestPass_m, kReachOfPasses_sigmas * sigma_of(newest, map.graph)) +
      2.0 * range_m + kExtent_m;
  far_m_ = std::max(hand_over_m_, reach_m + kHysteresis_m);

  std::vector<std::pair<double, model::SubmapId>> near;
  for (const Away& away : away_) {
    const double distance_m = (map.graph.pose(away.node).translation() - vehicle_m).norm();
    if (distance_m < reach_m) near.emplace_back(distance_m, away.id);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > kMostWanted) near.resize(kMostWanted);
  const auto is_asked = [&](model::SubmapId id) {
    return std::ranges::find(wanted_, id) != wanted_.end();
  };
  coming_.clear();
  for (const auto& [distance_m, id] : near)
    if (!is_asked(id)) coming_.push_back(id);
  std::erase_if(wanted_, [&](model::SubmapId id) {
    return std::ranges::none_of(near, [&](const auto& one) { return one.second == id; });
  });

  if (freeze(reach_m, vehicle_m, map)) return true;
  if (may_hand_over_) close_origin(vehicle_m, map);
  return false;
}

/// A submap that does not arrive, since no store has it, does not delay others.
bool Submaps::ask_for_next() {
  if (coming_.empty()) return false;
  wanted_.push_back(coming_.front());
  coming_.erase(coming_.begin());
  return true;
}

bool Submaps::give_next_away(NodeIndex newest, model::Utime utime, GlobalMap& map) {
  if (!may_hand_over_ || !far_m_) return false;
  // Only whole submaps: no observation of the node is in the solved graph.
  const Eigen::Vector2d vehicle_m = map.graph.pose(newest).translation();
  const auto next = std::ranges::find_if(here_, [&](const Here& here) {
    return (map.graph.pose(here.node).translation() - vehicle_m).norm() > *far_m_ &&
           map.graph.node(here.node).observations().empty();
  });
  if (next == here_.end()) return false;
  map.graph.checkpoint();
  give_away(Here(*next), utime, map);
  return true;  // Its information is in the graph as before.
}

/// The first node is in no stretch: far behind the vehicle it becomes a submap of its own.
void Submaps::close_origin(const Eigen::Vector2d& vehicle_m, GlobalMap& map) {
  const auto origin = map.graph.origin();
  if (!origin || map.graph.node(*origin).is_condensed) return;
  if ((map.graph.pose(*origin).translation() - vehicle_m).norm() < *far_m_) return;
  map.graph.close(*origin);
  here_.push_back({*origin, std::nullopt});
}

/// Limits the solved graph to the map around the vehicle: its cost does not grow with the path.
/// True if it solved.
bool Submaps::freeze(double reach_m, const Eigen::Vector2d& vehicle_m, GlobalMap& map) {
  std::vector<NodeIndex> far;
  std::vector<NodeIndex> near;
  for (const Away& away : away_) {
    const double distance_m = (map.graph.pose(away.node).translation() - vehicle_m).norm();
    const bool is_frozen = map.graph.is_frozen(away.node);
    if (is_frozen && distance_m < reach_m + kThawedBeyond_m) near.push_back(away.node);
    if (!is_frozen && distance_m > reach_m + kFrozenBeyond_m) far.push_back(away.node);
  }
  if (near.empty() && far.size() < kFrozenTogether + unfreezable_) return false;

  map.graph.checkpoint();
  if (!near.empty()) {
    // Thaws nodes that the vehicle approaches.
    for (const Away& away : away_) {
      const double distance_m = (map.graph.pose(away.node).translation() - vehicle_m).norm();
      if (distance_m < reach_m + 2.0 * kThawedBeyond_m) near.push_back(away.node);
    }
    map.graph.thaw(near);
  } else {
    unfreezable_ = map.graph.freeze(far) ? 0 : far.size();
    if (unfreezable_ > 0) return false;
  }
  (void)map.graph.solve();  // Their information is in the graph as before.
  map.adopt_estimates();
  return true;
}

void Submaps::give_away(const Here& here, model::Utime utime, GlobalMap& map) {
  model::Submap submap;
  submap.utime = utime;
  submap.map_id = map.landmarks.map_id();
  submap.id = next_id_++;
  submap.map_T_submap = map.graph.pose(here.node);
  if (here.was) submap.replaced.push_back(*here.was);

  // The part that other processes read.
  const geometry::SE2 submap_T_map = submap.map_T_submap.inverse();
  std::vector<model::LandmarkId> ids;
  for (const model::LandmarkId id : map.graph.dormant_of(here.node))
    if (map.graph.home_of(id) == here.node) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  for (const model::LandmarkId id : ids) {
    model::MapLandmark& out = submap.landmarks.emplace_back(map.landmark(map.landmarks.at(id)));
    out.position_m = submap_T_map * out.position_m;
  }

  // Removes it from the map.
  SubmapContent content;
  content.node = here.node;
  content.motions = map.graph.motions_of(here.node);
  AwayLandmarks away = map.graph.put_away(ids);
  content.observed = std::move(away.observed);
  content.ties = std::move(away.ties);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    content.landmarks.push_back(map.landmarks.put_away(ids[i]));
    submap.landmarks[i].covariance_m2 =
        information_in(here.node, content.observed[i], map.graph).inverse();
  }
  content.bases = map.trajectory.put_away(here.node);
  for (const Base& base : content.bases.bases) {
    submap.keyframes.push_back(
        {base.sequence, base.utime, base.centre_T_base.mean, base.centre_T_base.covariance});
  }

  submap.payload = submap_payload(content);
  submap.content_hash = model::fnv1a(submap.payload);
  away_.push_back({here.node, submap.id, submap.content_hash});
  std::erase_if(here_, [&](const Here& one) { return one.node == here.node; });
  given_away_.push_back(std::move(submap));
}

std::string Submaps::bring_back(const model::Submap& submap, GlobalMap& map) {
  const std::string name = "submap " + std::to_string(submap.id);
  if (submap.map_id != map.landmarks.map_id()) return name + " is of another map";
  const auto away = std::ranges::find(away_, submap.id, &Away::id);
  if (away == away_.end()) return name + " is not away";
  if (submap.content_hash != away->content_hash ||
      model::fnv1a(submap.payload) != away->content_hash)
    return name + " is not as it was given away";

  SubmapContent content;
  std::vector<model::LandmarkId> ids;
  try {
    content = submap_content(submap.payload);
    for (const StoredLandmark& landmark : content.landmarks) ids.push_back(landmark.id);
    if (content.node != away->node) return name + " is of another node";
    map.graph.checkpoint();
    std::vector<NodeIndex> nodes{away->node};
    for (const auto& observed : content.observed)
      for (const DormantObservation& one : observed) nodes.push_back(one.node);
    if (map.graph.thaw(nodes)) {
      (void)map.graph.solve();  // Alone, as always when many variables return.
      map.adopt_estimates();
      map.graph.checkpoint();
    }
    map.graph.bring_back(ids, {content.observed, content.ties});
  } catch (const std::invalid_argument& error) {
    return name + ": " + error.what();
  }

  for (StoredLandmark& landmark : content.landmarks) {
    landmark.position_m = map.graph.dormant_position(landmark.id);
    map.landmarks.bring_back(std::move(landmark));
  }
  map.trajectory.bring_back(away->node, std::move(content.bases), map.graph);
  here_.push_back({away->node, away->id});
  std::erase(wanted_, away->id);
  std::erase(coming_, away->id);
  away_.erase(away);
  return {};
}

std::vector<model::SubmapPose> Submaps::poses(const PoseGraph& graph) const {
  std::vector<model::SubmapPose> result;
  result.reserve(away_.size() + here_.size());
  for (const Away& away : away_) result.push_back({away.id, graph.pose(away.node)});
  for (const Here& here : here_)
    if (here.was) result.push_back({*here.was, graph.pose(here.node)});
  std::ranges::sort(result, {}, &model::SubmapPose::id);
  return result;
}

std::optional<NodeIndex> Submaps::node_of(model::SubmapId id) const {
  for (const Away& away : away_)
    if (away.id == id) return away.node;
  for (const Here& here : here_)
    if (here.was == id) return here.node;
  return std::nullopt;
}

}  // namespace understory::geoslam_mapper::smoothing
