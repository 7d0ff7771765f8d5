// The largest set of point pairs that fits one rigid motion.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::associator {

/// A point of either set.
struct ConsistencyPoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame of its set.
  double variance_m2 = 0.0;                              ///< Isotropic, per axis.
  int kind = 0;                                          ///< Points of different kinds never pair.
};

/// Limits of the search.
struct ConsistencyGate {
  double sigmas = 4.0;        ///< For the difference of two distances.
  double shift_m = 2.0;       ///< Largest error of the guess: translation.
  double rotation_rad = 0.5;  ///< Largest error of the guess: heading.
  int max_nodes =
      20000;  ///< Nodes of the search tree; beyond this the best set so far is returned.
};

/// A reference point and the observed point paired with it, as indices.
struct ConsistencyPair {
  std::uint32_t reference = 0;
  std::uint32_t observed = 0;
};

/// Pairs such that all distances between references equal those between the observed, within noise:
/// the largest clique of the graph of compatible pairs (Bailey 2002), by branch and bound with
/// colour bounds (Tomita & Seki 2003). `guess`: reference_T_observed. At most the 24 observed
/// points nearest to the origin and the 512 pairs nearest to the guess are used. In order of
/// `observed`. Cost: exponential in the worst case, bounded by `gate.max_nodes`.
std::vector<ConsistencyPair> consistent_set(std::span<const ConsistencyPoint> reference,
                                            std::span<const ConsistencyPoint> observed,
                                            const geometry::SE2& guess,
                                            const ConsistencyGate& gate);

}  // namespace understory::associator
