// The measurements between the parts of a stored map.
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
  std::uint64_t closure = 0;                              ///< Number of its closure; 0 = none.
};

/// A landmark observed by one node, in the node's frame.
struct View {
  NodeNumber node = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< [1/m^2]
};

/// The mapper's measurements between stored submaps.
struct Ties {
  /// The submap of each node; other nodes were in ground held by the mapper.
  std::map<NodeNumber, model::SubmapId> submap_of;
  std::vector<Motion> motions;  ///< A motion may be listed by both of its nodes.
  /// For each landmark observed by several nodes: its views.
  std::vector<std::vector<View>> landmarks;
};

/// The parts with their measurements, linearised at the stored map: each measurement is set equal
/// to the present map and keeps its information. Therefore factors of the mapper's graph that are
/// not in the file cause no move, and a closure acts as in the mapper's graph, except for these
/// factors.
struct PartGraph {
  std::vector<Part> parts;
  /// Pose i is part i; nodes of the ground connected to submaps follow. The first part is held.
  factor_graph::plane::Graph graph;
  std::size_t motions = 0;  ///< Number of measured motions.
  std::size_t shared = 0;   ///< Number of landmarks observed by several nodes.
  /// Number of assumed motions, which are not in the file: between pieces of the ground, and where
  /// a drive's submaps would not be connected. Their variance per metre is the median of measured
  /// ones.
  std::size_t assumed = 0;
  /// This variance, (x, y [m^2], heading [rad^2]) for each metre.
  Eigen::Vector3d drift_per_m = Eigen::Vector3d::Zero();
};

/// `closures`: those in the file; one that is not among the ties gets sigmas of 0.1 m and 0.5
/// degrees. Throws ClosureError where the map has no submaps, or no measurement between them. Cost:
/// see parts_of(); the rest is linear.
PartGraph part_graph(const map_file::StoredMap& map, std::span<const model::Submap> submaps,
                     const Ties& ties, std::span<const model::LoopClosure> closures);

/// Place of an end of a closure.
struct PlacedEnd {
  std::size_t part = 0;  ///< Index in PartGraph::parts.
  geometry::SE2 part_T_end;
};
/// Throws ClosureError, with `option` in front, where the map has no such end.
PlacedEnd placed_end(const map_file::StoredMap& map, const PartGraph& graph,
                     const model::LoopEnd& end, const std::string& option);

}  // namespace understory::map_closure
