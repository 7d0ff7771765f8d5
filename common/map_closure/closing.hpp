// A loop closed between two parts of a stored map.
#pragma once

#include <vector>

#include "common/map_closure/part_graph.hpp"

namespace understory::map_closure {

/// Squared Mahalanobis distance (3 degrees of freedom) that chance exceeds once in 10^6: as the
/// mapper's for closures that are said live.
inline constexpr double kContradiction = 30.7;

/// How two parts lie to each other, as somebody says.
struct Closure {
  std::size_t from = 0;
  std::size_t to = 0;
  geometry::SE2WithCovariance from_T_to;  ///< Of the parts' own frames.
};

/// From what is said of two ends in the parts. Throws ClosureError where both are in one part, or
/// where a number is not finite or the covariance has no inverse.
Closure closure_between(const PlacedEnd& from, const PlacedEnd& to,
                        const geometry::SE2WithCovariance& from_end_T_to_end);

/// What the map knows of the two, without the closure.
struct Expectation {
  geometry::SE2WithCovariance from_T_to;
  double chi2 = 0.0;  ///< Of the closure against it, by both covariances; 3 degrees of freedom.
};
/// Throws ClosureError where the graph does not determine the two. Cost: one factorisation.
Expectation expectation(const PartGraph& graph, const Closure& closure);

/// The parts with the closure.
struct ClosedGraph {
  std::vector<geometry::SE2> poses;     ///< map_T_part, in the order of the parts.
  std::vector<Eigen::Matrix3d> before;  ///< Their covariances without the closure ...
  std::vector<Eigen::Matrix3d> after;   ///< ... and with it; right perturbation.
  double closure_chi2 = 0.0;            ///< What is left of the closure; 3 degrees of freedom.
  double graph_chi2 = 0.0;              ///< Strain in everything else.
};
/// The optimum of all measurements and the closure (Levenberg-Marquardt on CHOLMOD). Throws
/// ClosureError where they determine none.
ClosedGraph closed(const PartGraph& graph, const Closure& closure);

/// How far things went.
struct Shifts {
  double landmark_m = 0.0;   ///< The farthest landmark or keyframe.
  double heading_rad = 0.0;  ///< The most that a part was turned.
  std::size_t parts = 0;     ///< That moved by more than 1 mm or 0.01 degrees.
};

/// The map where the closed graph has it: landmarks, trajectory, borders and the ends of closures
/// move with their parts. What a part's submap owns keeps its covariance relative to the submap, as
/// the store shows it; covariances of what the mapper held (Part::is_held)
/// lose what the closure tells of their parts.
map_file::StoredMap moved(const map_file::StoredMap& map, const PartGraph& graph,
                          const ClosedGraph& closed, Shifts& shifts);

/// Landmarks of one kind that lie within `within_m` of one of another part that is no neighbour on
/// the path, each the other's nearest: trees that are in the map twice, it seems. In pairs.
std::size_t coincident_pairs(const map_file::StoredMap& map, const PartGraph& graph,
                             double within_m);

}  // namespace understory::map_closure
