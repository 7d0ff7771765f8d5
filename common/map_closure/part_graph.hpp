// What is known of how the parts of a stored map lie to each other.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"
#include "common/map_closure/parts.hpp"

namespace understory::map_closure {

/// Number of a node of the mapper's graph.
using NodeNumber = std::uint32_t;

/// A motion that the mapper measured between two nodes.
struct Motion {
  NodeNumber from = 0;
  NodeNumber to = 0;
  geometry::SE2 from_T_to;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< Right perturbation.
  std::uint64_t closure = 0;                              ///< Its number; 0: none.
};

/// What one node observed of a landmark, in its frame.
struct View {
  NodeNumber node = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< [1/m^2]
};

/// What the mapper measured of stored submaps.
struct Ties {
  /// The submaps that nodes are. Others were in ground that the mapper held.
  std::map<NodeNumber, model::SubmapId> submap_of;
  std::vector<Motion> motions;  ///< One may be named by both of its nodes.
  /// The views of each landmark that several nodes observed.
  std::vector<std::vector<View>> landmarks;
};

/// The parts with their measurements, as a linearisation where the mapper left them: each
/// measurement agrees with the map as it is, with the information that it has. So what the file
/// does not have of the mapper's graph moves nothing, and a closure moves what it would there, but
/// for that.
struct PartGraph {
  std::vector<Part> parts;
  /// Pose i is part i; nodes of the ground that submaps are tied to come behind them. The first
  /// part is held.
  factor_graph::plane::Graph graph;
  std::size_t motions = 0;  ///< Measured ones.
  std::size_t shared = 0;   ///< Landmarks that several nodes observed.
  /// Motions that the file does not have: of pieces of the ground, and where a drive's submaps
  /// would fall apart. They are as uncertain for each metre as measured ones are in the median.
  std::size_t assumed = 0;
  /// That variance, (x, y [m^2], heading [rad^2]) for each metre.
  Eigen::Vector3d drift_per_m = Eigen::Vector3d::Zero();
};

/// `closures`: those that the file keeps; one that is not among the ties is taken to be known to
/// 0.1 m and 0.5 degrees. Throws ClosureError where the map has no submaps, or nothing measured
/// between them. Cost: see parts_of(); the rest is linear.
PartGraph part_graph(const map_file::StoredMap& map, std::span<const model::Submap> submaps,
                     const Ties& ties, std::span<const model::LoopClosure> closures);

/// Where an end of a closure is.
struct PlacedEnd {
  std::size_t part = 0;  ///< Place in PartGraph::parts.
  geometry::SE2 part_T_end;
};
/// Throws ClosureError, with `option` in front, where the map has no such end.
PlacedEnd placed_end(const map_file::StoredMap& map, const PartGraph& graph,
                     const model::LoopEnd& end, const std::string& option);

}  // namespace understory::map_closure
