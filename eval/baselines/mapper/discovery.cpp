#include "eval/baselines/mapper/discovery.hpp"

namespace understory::eval::baselines::mapper {

/// Adds the node and gives those that form a group with it: itself and every neighbour whose links
/// into the neighbourhood reach the number needed (itself and the new node count as two).
std::set<ObservationKey> DiscoveryNetwork::link(ObservationKey id, const Observation& observation,
                                                const DiscoveryParameters& parameters) {
  Node added{observation, {}};
  for (const auto& [other_id, other] : nodes_) {
    if (other_id.first != id.first &&
        (other.observation.in_map_m - observation.in_map_m).cwiseAbs().maxCoeff() <
            parameters.association_distance_m) {
      added.neighbours.insert(other_id);
    }
  }

  std::set<ObservationKey> group{id};
  for (const ObservationKey& neighbour : added.neighbours) {
    int tally = 2;
    for (const ObservationKey& other : nodes_.at(neighbour).neighbours) {
      tally += added.neighbours.contains(other) ? 1 : 0;
    }
    if (tally >= parameters.observations_needed) {
      group.insert(neighbour);
    }
  }

  for (const ObservationKey& neighbour : added.neighbours) {
    nodes_.at(neighbour).neighbours.insert(id);
  }
  nodes_.emplace(id, std::move(added));
  return group;
}

void DiscoveryNetwork::remove(ObservationKey id) {
  const auto node = nodes_.find(id);
  if (node == nodes_.end()) {
    return;
  }
  for (const ObservationKey& neighbour : node->second.neighbours) {
    nodes_.at(neighbour).neighbours.erase(id);
  }
  nodes_.erase(node);
}

std::vector<Discovery> DiscoveryNetwork::add(std::uint32_t pose,
                                             const std::vector<Observation>& observations,
                                             const DiscoveryParameters& parameters) {
  std::vector<Discovery> discoveries;
  poses_.insert(pose);
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const std::set<ObservationKey> group = link({pose, i}, observations[i], parameters);
    if (static_cast<int>(group.size()) < parameters.observations_needed) {
      continue;
    }

    Discovery discovery;
    for (const ObservationKey& member : group) {
      const Observation& observation = nodes_.at(member).observation;
      discovery.position_m += observation.in_map_m;
      discovery.observations.emplace_back(member.first, observation);
      remove(member);
    }
    discovery.position_m /= static_cast<double>(group.size());
    discoveries.push_back(std::move(discovery));
  }
  return discoveries;
}

void DiscoveryNetwork::slide(const DiscoveryParameters& parameters) {
  if (static_cast<int>(poses_.size()) < parameters.window) {
    return;
  }
  const std::uint32_t oldest = *poses_.begin();
  while (!nodes_.empty() && nodes_.begin()->first.first == oldest) {
    remove(nodes_.begin()->first);
  }
  poses_.erase(poses_.begin());
}

}  // namespace understory::eval::baselines::mapper
