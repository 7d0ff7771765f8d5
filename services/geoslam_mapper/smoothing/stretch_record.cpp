// Copies the factors of a stretch out of the graph.
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/condensing.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// The keyframes tied to a node.
std::vector<Stretch::Keyframe> keyframes_of(NodeIndex node, const Trajectory& trajectory) {
  std::vector<Stretch::Keyframe> keyframes;
  for (const Base& base : trajectory.bases()) {
    if (base.node == node)
      keyframes.push_back({base.sequence, base.utime, base.centre_T_base.mean});
  }
  return keyframes;
}

void add_stretch_observations(const plane::Graph& graph,
                              std::span<const model::LandmarkId> landmarks, Stretch& stretch) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
  if (graph.poses.size() > kMost || landmarks.size() > kMost)
    throw std::length_error("a stretch of more than 65535 nodes or landmarks");
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    stretch.landmarks.push_back({landmarks[i], graph.points[i].cast<float>()});
  for (const plane::PointObservation& factor : graph.observations) {
    const Eigen::Vector2f position = factor.position.cast<float>();
    const Eigen::Matrix2f information = factor.information.cast<float>();
    stretch.observations.push_back({static_cast<std::uint16_t>(index(factor.pose)),
                                    static_cast<std::uint16_t>(index(factor.point)),
                                    {position.x(), position.y()},
                                    {information(0, 0), information(0, 1), information(1, 1)}});
  }
}

}  // namespace

/// Positions are in the frame `map`. Motions to nodes of earlier stretches were stored with those.
Stretch Condensing::stretch_of(std::span<const Passed> passed, const GlobalMap& map) const {
  std::map<NodeIndex, StretchNumber> numbers;
  for (const Passed& one : waiting_) numbers[one.node] = one.number;
  for (const Passed& one : passed) numbers[one.node] = one.number;
  const auto bases = map.trajectory.bases();
  if (!bases.empty() && bases.front().is_origin) numbers[bases.front().node] = StretchNumber(0);

  std::vector<NodeIndex> nodes;
  nodes.reserve(passed.size());
  Stretch stretch;
  for (const Passed& one : passed) {
    nodes.push_back(one.node);
    stretch.poses.push_back(
        {one.number, one.scans, map.graph.pose(one.node), keyframes_of(one.node, map.trajectory)});
  }
  const PoseGraph::Part part = map.graph.part_of(nodes);
  add_stretch_observations(part.graph, part.landmarks, stretch);

  const auto number_of = [&](plane::PoseId id) -> std::optional<StretchNumber> {
    if (index(id) < nodes.size()) return passed[index(id)].number;
    const auto found = numbers.find(part.outer[index(id) - nodes.size()].node);
    return found == numbers.end() ? std::nullopt : std::optional(found->second);
  };
  const auto add = [&](const plane::RelativePose& motion, double seconds, double bias_rad_s) {
    const auto a = number_of(motion.a);
    const auto b = number_of(motion.b);
    if (a && b)
      stretch.motions.push_back({*a, *b, motion.a_T_b, motion.information, seconds, bias_rad_s});
  };
  for (const plane::RelativePose& motion : part.graph.relative_poses) add(motion, 0.0, 0.0);
  for (const plane::BiasedRelativePose& one : part.graph.biased_relative_poses)
    add(one.motion, one.seconds, part.graph[one.bias]);
  return stretch;
}

Stretch Condensing::rest(const GlobalMap& map) const {
  std::vector<Passed> nodes;
  const auto bases = map.trajectory.bases();
  if (!bases.empty() && bases.front().is_origin) {
    const NodeIndex first = bases.front().node;
    nodes.push_back({first, map.graph.node(first).along_m, 1, StretchNumber(0)});
  }
  std::copy_if(waiting_.begin(), waiting_.end(), std::back_inserter(nodes),
               [&](const Passed& passed) { return is_there(passed, map.graph); });
  return stretch_of(nodes, map);
}

void Stretch::turn_to(std::span<const Retirement> retired) {
  node = retired.front().into;
  const geometry::SE2 origin_T_map =
      retired.front().into_T_node.mean * poses.front().origin_T_node.inverse();
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i].origin_T_node = retired[i].into_T_node.mean;
  for (Landmark& landmark : landmarks) {
    const Eigen::Vector2d there = origin_T_map * landmark.origin_p_landmark.cast<double>();
    landmark.origin_p_landmark = there.cast<float>();
  }
}

}  // namespace understory::geoslam_mapper::smoothing
