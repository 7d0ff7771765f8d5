// The source's discovery of new landmarks (GeoSLAM §4.3.4, algorithm 5).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::geoslam_mapper::baseline {

/// One unmatched landmark of one keyframe: pose number, number within that pose.
using ObservationKey = std::pair<std::uint32_t, std::uint32_t>;

struct Observation {
  Eigen::Vector2d in_map_m = Eigen::Vector2d::Zero();  ///< As placed when it was seen.
  Eigen::Vector2d in_pose_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  std::uint16_t observation_count = 0;
};

struct Discovery {
  Eigen::Vector2d position_m =
      Eigen::Vector2d::Zero();  ///< Mean of the sightings, frame of the map.
  std::vector<std::pair<std::uint32_t, Observation>> observations;  ///< Pose, what it saw.
};

struct DiscoveryParameters {
  int observations_needed = 4;          ///< [k]
  int window = 5;                       ///< [omega] Poses.
  double association_distance_m = 0.5;  ///< [delta] Per axis.
};

/// Sightings of the last poses and which of them lie together.
class DiscoveryNetwork {
 public:
  /// Adds what pose number `pose` saw and could not match; gives the landmarks that this makes
  /// certain, whose sightings leave the network. The published tally: a sighting belongs when it
  /// shares enough links, so the result need not be a clique and may hold two sightings of one
  /// pose.
  std::vector<Discovery> add(std::uint32_t pose, const std::vector<Observation>& observations,
                             const DiscoveryParameters& parameters);
  /// Forgets the oldest pose when the window is full; after an accepted update.
  void slide(const DiscoveryParameters& parameters);

  struct Node {
    Observation observation;
    std::set<ObservationKey> neighbours;
  };
  const std::map<ObservationKey, Node>& nodes() const { return nodes_; }
  const std::set<std::uint32_t>& poses() const { return poses_; }
  /// For load(): links are given by the nodes.
  DiscoveryNetwork(std::map<ObservationKey, Node> nodes, std::set<std::uint32_t> poses)
      : nodes_(std::move(nodes)), poses_(std::move(poses)) {}
  DiscoveryNetwork() = default;

 private:
  std::set<ObservationKey> link(ObservationKey id, const Observation& observation,
                                const DiscoveryParameters& parameters);
  void remove(ObservationKey id);

  std::map<ObservationKey, Node> nodes_;
  std::set<std::uint32_t> poses_;  ///< In the window, also those that left no node.
};

}  // namespace understory::geoslam_mapper::baseline
