// A loop closed between two parts of a stored map.
#pragma once

#include <vector>

#include "common/map_closure/part_graph.hpp"

namespace understory::map_closure {

/// Squared Mahalanobis distance (3 degrees of freedom) that chance exceeds once in 10^6: the same
/// as the mapper's for closures set by hand.
inline constexpr double kContradiction = 30.7;

/// A stated relative pose of two parts.
struct Closure {
  std::size_t from = 0;
  std::size_t to = 0;
  geometry::SE2WithCovariance from_T_to;  ///< Between the parts' own frames.
};

/// Closure from two stated ends in the parts. Throws ClosureError where both are in one part, or
/// where a number is not finite or the covariance has no inverse.
Closure closure_between(const PlacedEnd& from, const PlacedEnd& to,
                        const geometry::SE2WithCovariance& from_end_T_to_end);

/// The map's estimate of the relative pose, without the closure.
struct Expectation {
  geometry::SE2WithCovariance from_T_to;
  /// Difference of the closure from it, by both covariances; 3 degrees of freedom.
  double chi2 = 0.0;
};
/// Throws ClosureError where the graph does not determine the two. Cost: one factorisation.
Expectation expectation(const PartGraph& graph, const Closure& closure);

/// The parts with the closure.
struct ClosedGraph {
  std::vector<geometry::SE2> poses;     ///< map_T_part, in the order of the parts.
  std::vector<Eigen::Matrix3d> before;  ///< Their covariances without the closure ...
  std::vector<Eigen::Matrix3d> after;   ///< ... and with it; right perturbation.
  double closure_chi2 = 0.0;            ///< Residual of the closure; 3 degrees of freedom.
  double graph_chi2 = 0.0;              ///< Sum of the residuals of all other measurements.
};
/// The optimum of all measurements and the closure (Levenberg-Marquardt on CHOLMOD). Throws
/// ClosureError where it is not determined.
ClosedGraph closed(const PartGraph& graph, const Closure& closure);

/// Extent of the changes.
struct Shifts {
  double landmark_m = 0.0;   ///< Largest move of a landmark or keyframe.
  double heading_rad = 0.0;  ///< Largest rotation of a part.
  std::size_t parts = 0;     ///< Parts that moved by more than 1 mm or 0.01 degrees.
};

/// The map at the poses of the closed graph: landmarks, trajectory, borders and the ends of
/// closures move with their parts. Content of a submap keeps its covariance, which is relative to
/// the submap; for parts held by the mapper (Part::is_held) the closure's reduction of the pose
/// covariance is subtracted.
map_file::StoredMap moved(const map_file::StoredMap& map, const PartGraph& graph,
                          const ClosedGraph& closed, Shifts& shifts);

/// Number of pairs of landmarks of one kind within `within_m`, each the other's nearest, in two
/// parts that are not adjacent on the path: these trees are probably in the map twice.
std::size_t coincident_pairs(const map_file::StoredMap& map, const PartGraph& graph,
                             double within_m);

}  // namespace understory::map_closure
