// The baseline's discovery of new landmarks (GeoSLAM §4.3.4, algorithm 5).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::eval::baselines::mapper {

/// One unmatched landmark of one keyframe: pose number, number within that pose.
using ObservationKey = std::pair<std::uint32_t, std::uint32_t>;

/// A landmark of a keyframe that the map does not have.
struct Observation {
  /// Frame `map`, by the pose of the keyframe when it was added.
  Eigen::Vector2d in_map_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d in_pose_m = Eigen::Vector2d::Zero();  ///< Frame of the keyframe's base.
  double radius_m = 0.0;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  std::uint16_t observation_count = 0;  ///< Scans of the keyframe that detected it.

  /// All of it.
  bool operator==(const Observation&) const = default;
};

/// A new landmark.
struct Discovery {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Observations' mean, frame `map`.
  /// Number of the pose, and what it observed.
  std::vector<std::pair<std::uint32_t, Observation>> observations;
};

/// Symbols of the thesis in brackets.
struct DiscoveryParameters {
  int observations_needed = 4;          ///< [k]
  int window = 5;                       ///< [omega] Poses.
  double association_distance_m = 0.5;  ///< [delta] Per axis.
};

/// Observations of the last poses, linked where they lie together.
class DiscoveryNetwork {
 public:
  /// An empty network.
  DiscoveryNetwork() = default;

  /// Adds what pose number `pose` observed and could not match. Returns the landmarks that this
  /// confirms; their observations leave the network. As published, an observation belongs to a
  /// landmark when it shares enough links: the result need not be a clique, and may hold two
  /// observations of one pose. O(observations in the window) per observation.
  std::vector<Discovery> add(std::uint32_t pose, const std::vector<Observation>& observations,
                             const DiscoveryParameters& parameters);
  /// Forgets the oldest pose when the window is full; after an accepted update.
  void slide(const DiscoveryParameters& parameters);

  /// An observation and the observations near it.
  struct Node {
    Observation observation;
    std::set<ObservationKey> neighbours;

    /// All of it.
    bool operator==(const Node&) const = default;
  };
  /// All observations in the window.
  const std::map<ObservationKey, Node>& nodes() const { return nodes_; }
  /// Numbers of the poses in the window.
  const std::set<std::uint32_t>& poses() const { return poses_; }

  /// All of it.
  bool operator==(const DiscoveryNetwork&) const = default;

 private:
  std::set<ObservationKey> link(ObservationKey id, const Observation& observation,
                                const DiscoveryParameters& parameters);
  void remove(ObservationKey id);

  std::map<ObservationKey, Node> nodes_;
  std::set<std::uint32_t> poses_;  ///< In the window, also those without an observation.
};

}  // namespace understory::eval::baselines::mapper
