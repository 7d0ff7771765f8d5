// One submap of the baseline.
#pragma once

#include <vector>

#include "common/factor_graph/plane/graph.hpp"
#include "eval/experiments/partition/baseline.hpp"

namespace understory::eval::experiments::partition {

/// Poses `first` to `last` of a drive, both of which are shared with its neighbours, and the
/// factors that are of this submap alone: no factor is in two.
struct BaselineSubmap {
  std::size_t first = 0;
  std::size_t last = 0;
  /// Its own graph, first pose held where the drive has it.
  factor_graph::plane::Graph graph;
  std::vector<factor_graph::plane::PointId> points;  ///< Their numbers in the drive, by own number.
  /// Own numbers of the landmarks that it shares.
  std::vector<std::size_t> shared_points;

  /// The pose in the middle of the track (§2.3.3); never a shared one.
  std::size_t origin() const { return (last - first) / 2; }
};

/// Cuts the drive at these poses. Throws std::runtime_error where a submap would have less than
/// three poses.
std::vector<BaselineSubmap> submaps_of(const DriveGraph& drive,
                                       const std::vector<std::size_t>& cuts, Shared shared);
/// Optimises it by itself. Throws std::runtime_error naming it where it is not determined.
void optimise(BaselineSubmap& submap);
/// Entrance, exit and shared landmarks in the frame of the origin, at the submap's optimum; the
/// covariance of the landmarks is in that frame, too. Throws likewise.
Relations condense(const BaselineSubmap& submap, Propagation propagation);
/// Its poses with what it shares held: poses by `entrance` and `exit`, landmarks by `shared_m`.
std::vector<geometry::SE2> expand(const BaselineSubmap& submap, const geometry::SE2& entrance,
                                  const geometry::SE2& exit,
                                  const std::vector<Eigen::Vector2d>& shared_m);
/// Mean time of an update [ms] where its poses are added one by one to an incremental smoother.
double iteration_ms(const BaselineSubmap& submap);
/// Size of the submap as it is stored.
std::size_t stored_bytes(const BaselineSubmap& submap);

}  // namespace understory::eval::experiments::partition
