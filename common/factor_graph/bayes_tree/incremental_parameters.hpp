// The limits of the incremental smoother; products and experiments use the same set.
#pragma once

#include <cstddef>

namespace understory::factor_graph::bayes_tree {

/// Default memory for numbers that a rollback needs [bytes].
constexpr std::size_t kUndoBytes = std::size_t{1} << 20U;

/// Accuracy and effort of the smoother. With these defaults the newest pose and its landmarks are
/// within 0.05 sigma of the present batch solution (p99), and chi^2 within 0.1 %, except shortly
/// after a large closure; docs/decisions/127 has graphs with larger differences. `sigma`: standard
/// deviation of the measurement, or of the variable given those above it in the tree.
struct IncrementalParameters {
  /// A variable stays if it would move by less [sigma].
  double least_move = 1e-3;
  /// A factor whose residual is this far from its linearisation is linearised again with the next
  /// update [sigma]. The limit is for a relative pose in the plane; in space it is larger by the
  /// root of the number of rows. Linearisations of different ages cause torques that rotate the
  /// connected part of the graph: at 1e-3 the poses of a 4 km road were up to 0.18 m from those of
  /// the batch solution, at 1e-4 0.04 m.
  double relinearise_above = 1e-4;
  /// An update iterates (up to max_iterations) while a factor is this far from its linearisation
  /// [sigma].
  double iterate_above = 0.05;
  int max_iterations = 8;  ///< Most iterations of one update.
  /// Memory for numbers that a rollback needs. The rollback computes the others again, at the cost
  /// of the undone updates.
  std::size_t undo_bytes = kUndoBytes;
};

}  // namespace understory::factor_graph::bayes_tree
