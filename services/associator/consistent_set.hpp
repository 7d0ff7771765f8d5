// The largest set of point pairs that one rigid motion explains.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::associator {

struct ConsistencyPoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double variance_m2 = 0.0;
  int kind = 0;  ///< Points of different kinds never pair.
};

struct ConsistencyGate {
  double sigmas = 4.0;
  /// Farthest that the guess may be off: translation, plus a turn at the point's range.
  double shift_m = 2.0;
  double rotation_rad = 0.5;
  int max_nodes = 20000;  ///< Of the search; then the best set found so far is taken.
};

struct ConsistencyPair {
  std::uint32_t reference = 0;
  std::uint32_t observed = 0;
};

/// Pairs such that all distances between references equal those between the observed, within noise:
/// the largest clique of the graph of compatible pairs (Bailey 2002), by branch and bound with
/// colour bounds (Tomita & Seki 2003). The observed nearest to the origin are used, at most 24.
std::vector<ConsistencyPair> consistent_set(std::span<const ConsistencyPoint> reference,
                                            std::span<const ConsistencyPoint> observed,
                                            const geometry::SE2& guess,
                                            const ConsistencyGate& gate);

}  // namespace understory::associator
