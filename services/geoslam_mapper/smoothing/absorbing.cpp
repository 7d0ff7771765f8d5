// Absorbs a graph into another one.
#include <algorithm>
#include <set>

#include "services/geoslam_mapper/smoothing/loose_graph.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

namespace {

FrozenMotion frozen_motion(const plane::RelativePose& motion) {
  return {index(motion.a), index(motion.b), motion.a_T_b, motion.information, 0, 0};
}

}  // namespace

LooseGraph PoseGraph::loosened() {
  unfreeze();
  LooseGraph loose;
  for (const Node& node : nodes_) {
    LooseGraph::LooseNode& one = loose.nodes.emplace_back();
    one.pose = smoother_.pose(node.centre);
    one.node = node;
    one.node.edit_observations().clear();
    one.node.edit_motions().clear();
    one.node.give_room_back();
  }
  for (const std::uint32_t number : free_nodes_.numbers()) loose.nodes[number].is_free = true;

  for (NodeIndex node = 0; node < nodes_.size(); ++node) {
    for (const auto& [id, number] : nodes_[node].observations()) {
      const plane::PointObservation& factor = smoother_.observation(number);
      LooseGraph::LooseLandmark& landmark = loose.solved[id];
      landmark.position_m = smoother_.point(factor.point);
      landmark.observed.push_back({node, factor.position, factor.information});
    }
  }
  loose.dormant = dormant_;
  for (const plane::PointPrior& prior : smoother_.graph().point_priors) {
    const model::LandmarkId id = landmark_of_point_[index(prior.point)];
    if (id != 0) loose.given[id] = {0, prior.mean, prior.information};
  }
  loose.motions = loose_motions();
  return loose;
}

/// The motion, reduced to its two nodes.
FrozenMotion PoseGraph::loose_motion(MotionRef ref) const {
  if (ref.is_biased) {
    const plane::BiasedRelativePose& biased = smoother_.motion(plane::BiasedMotionId(ref.number));
    FrozenMotion motion = frozen_motion(biased.motion);
    motion.a_T_b = plane::at_true_rate(motion.a_T_b, smoother_.scalar(biased.bias), biased.seconds);
    return motion;
  }
  FrozenMotion motion = frozen_motion(smoother_.motion(plane::MotionId(ref.number)));
  const auto closure = closures_.find(ref.number);
  if (closure != closures_.end()) motion.closure = closure->second;
  return motion;
}

/// The motion that represents stored landmarks, likewise.
FrozenMotion PoseGraph::away_motion(const TiedNodes& nodes, const Tie& tie) {
  return {nodes.first, nodes.second, tie.away.a_T_b, tie.away.information, tie.submaps, 0};
}

std::vector<FrozenMotion> PoseGraph::motions_of(NodeIndex node) const {
  std::vector<FrozenMotion> motions;
  motions.reserve(nodes_[node].motions().size());
  for (const MotionRef ref : nodes_[node].motions()) motions.push_back(loose_motion(ref));
  return motions;
}

/// All motions, each once, including frozen ones.
std::vector<FrozenMotion> PoseGraph::loose_motions() const {
  std::vector<FrozenMotion> motions = frozen_motions_.all();
  for (NodeIndex node = 0; node < nodes_.size(); ++node) {
    for (const MotionRef ref : nodes_[node].motions())
      if (ends_of(ref).first == node) motions.push_back(loose_motion(ref));
  }

  for (const auto& [nodes, tie] : ties_)
    if (tie.submaps > 0) motions.push_back(away_motion(nodes, tie));
  return motions;
}

NodeIndex PoseGraph::absorb(const LooseGraph& other, const geometry::SE2& map_T_other,
                            double further_m) {
  const auto first = static_cast<NodeIndex>(nodes_.size());
  for (const LooseGraph::LooseNode& one : other.nodes) {
    Node& node = nodes_.emplace_back(one.node);
    node.centre = smoother_.add_pose(map_T_other * one.pose);
    node.along_m += further_m;
    if (one.is_free) free_nodes_.give(static_cast<NodeIndex>(nodes_.size() - 1));
  }
  std::set<TiedNodes> changed;
  for (const FrozenMotion& one : other.motions) {
    absorb(one, first);
    if (one.away > 0) changed.emplace(first + one.a, first + one.b);
  }

  for (const auto& [id, landmark] : other.solved) {
    add_landmark(id, map_T_other * landmark.position_m, std::nullopt);
    for (const DormantObservation& seen : landmark.observed) {
      const NodeIndex node = first + seen.node;
      place_observation(node, id,
                        {nodes_[node].centre, point_of_.at(id), seen.position_m, seen.information});
    }
  }

  for (const auto& [id, observed] : other.dormant) {
    std::vector<DormantObservation>& ours = dormant_[id];
    for (DormantObservation seen : observed) {
      seen.node += first;
      dormant_of_node_[seen.node].landmarks.push_back(id);
      ours.push_back(seen);
    }
    for (const TiedNodes& nodes : tied_by(id)) {
      ties_[nodes].landmarks.push_back(id);
      changed.insert(nodes);
    }
  }
  renew(changed);
  return first;
}

/// A motion that represents stored landmarks is added as it is.
void PoseGraph::absorb(const FrozenMotion& motion, NodeIndex first) {
  const NodeIndex a = first + motion.a;
  const NodeIndex b = first + motion.b;
  if (motion.away > 0) return add_away({a, b, motion.a_T_b, motion.information, motion.away, 0});
  const plane::RelativePose measured{nodes_[a].centre, nodes_[b].centre, motion.a_T_b,
                                     motion.information};
  const bool is_closure = motion.closure != 0 && !has_closure(motion.closure);
  const MotionRef ref = link(measured, a, b);
  if (is_closure) closures_.emplace(ref.number, motion.closure);
}

}  // namespace understory::geoslam_mapper::smoothing
