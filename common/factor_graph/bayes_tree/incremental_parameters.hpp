// The one set of limits of the incremental smoother: what ships is what is measured.
#pragma once

#include <cstddef>

namespace understory::factor_graph::bayes_tree {

/// Memory for numbers that a rollback would need, unless something else is asked for [bytes].
constexpr std::size_t kUndoBytes = std::size_t{1} << 20U;

/// When and how exactly the smoother follows. With these defaults the newest pose and what it sees
/// are within 0.05 sigma of the batch solution of the moment (p99), and chi^2 within 0.1 % of it,
/// but for single moments behind a large closure; docs/decisions/127 has graphs that are further
/// off. `sigma`: of the measurement, or of the variable given those above it in the tree.
struct IncrementalParameters {
  /// A variable that would move by less stays [sigma].
  double least_move = 1e-3;
  /// A factor whose residual is this far from its linearisation is linearised again with the next
  /// update [sigma]. Of a relative pose in the plane; in space by the root of its rows more.
  /// Linearisations of different ages leave torques that rotate all that hangs on them: at 1e-3 the
  /// poses of a 4 km road were up to 0.18 m from those of the batch solution, at 1e-4 0.04 m.
  double relinearise_above = 1e-4;
  /// An update goes on (up to max_iterations) while a factor is this far from its linearisation
  /// [sigma].
  double iterate_above = 0.05;
  int max_iterations = 8;  ///< Of one update.
  /// Memory for numbers that a rollback would need. What does not fit is computed again by the
  /// rollback, at the cost of the updates that it takes back.
  std::size_t undo_bytes = kUndoBytes;
};

}  // namespace understory::factor_graph::bayes_tree
