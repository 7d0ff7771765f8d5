#include "services/geoslam_mapper/source_discovery.hpp"

namespace understory::source {

/// Adds the node and gives those that form a group with it: itself and every neighbour whose links
/// into the neighbourhood reach the number needed (itself and the new node count as two).
std::set<SightingId> DiscoveryNetwork::link(SightingId id, const Sighting& sighting,
                                            const DiscoveryParameters& parameters) {
  Node added{sighting, {}};
  for (const auto& [other_id, other] : nodes_) {
    if (other_id.first != id.first &&
        (other.sighting.in_map_m - sighting.in_map_m).cwiseAbs().maxCoeff() <
            parameters.association_distance_m) {
      added.neighbours.insert(other_id);
    }
  }
  std::set<SightingId> group{id};
  for (const SightingId& neighbour : added.neighbours) {
    int tally = 2;
    for (const SightingId& other : nodes_.at(neighbour).neighbours) {
      tally += added.neighbours.contains(other) ? 1 : 0;
    }
    if (tally >= parameters.sightings_needed) {
      group.insert(neighbour);
    }
  }
  for (const SightingId& neighbour : added.neighbours) {
    nodes_.at(neighbour).neighbours.insert(id);
  }
  nodes_.emplace(id, std::move(added));
  return group;
}

void DiscoveryNetwork::remove(SightingId id) {
  const auto node = nodes_.find(id);
  if (node == nodes_.end()) {
    return;
  }
  for (const SightingId& neighbour : node->second.neighbours) {
    nodes_.at(neighbour).neighbours.erase(id);
  }
  nodes_.erase(node);
}

std::vector<Discovery> DiscoveryNetwork::add(std::uint32_t pose,
                                             const std::vector<Sighting>& sightings,
                                             const DiscoveryParameters& parameters) {
  std::vector<Discovery> discoveries;
  poses_.insert(pose);
  for (std::uint32_t i = 0; i < sightings.size(); ++i) {
    const std::set<SightingId> group = link({pose, i}, sightings[i], parameters);
    if (static_cast<int>(group.size()) < parameters.sightings_needed) {
      continue;
    }
    Discovery discovery;
    for (const SightingId& member : group) {
      const Sighting& sighting = nodes_.at(member).sighting;
      discovery.position_m += sighting.in_map_m;
      discovery.sightings.emplace_back(member.first, sighting);
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

}  // namespace understory::source
