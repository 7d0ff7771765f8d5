// The factorised graph: a tree of cliques, each a dense front (the Bayes tree of iSAM2, Kaess et
// al. 2012, as a supernodal multifrontal Cholesky factorisation).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/factor_graph/bayes_tree/clique_plan.hpp"
#include "common/factor_graph/bayes_tree/front_kernel.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::bayes_tree {

/// Variables that are eliminated together. `panel` is size x pivots, column-major: the columns of L
/// of the frontal variables; its last row is the right-hand side. Behind it, where it is kept, the
/// lower triangle of the Schur complement on the separator, column by column.
struct CliqueRecord {
  int parent = graph::kNone;
  int first_child = graph::kNone;
  int next_sibling = graph::kNone;
  int previous_sibling = graph::kNone;
  int first_factor = graph::kNone;  ///< Those that are assembled here.
  int frontal_count = 0;            ///< Variables.
  int row_count = 0;                ///< Variables, frontal ones first, then the separator.
  int pivots = 0;                   ///< Scalars of the frontal variables.
  int size = 0;                     ///< Scalars of all, and the right-hand side.
  int left_out = 0;                 ///< Pivots without information.
  bool keeps_schur = true;
  int* rows = nullptr;
  double* panel = nullptr;
  std::uint64_t panel_epoch = 0;

  std::size_t panel_numbers() const {
    return static_cast<std::size_t>(size) * static_cast<std::size_t>(pivots);
  }
  std::size_t numbers() const {
    const auto rest = static_cast<std::size_t>(size - pivots);
    return panel_numbers() + (keeps_schur ? rest * (rest + 1) / 2 : 0);
  }
};

struct TreeStatistics {
  long eliminated_variables = 0;  ///< Structure and numbers made anew.
  long refreshed_cliques = 0;     ///< Numbers only.
  double flops = 0.0;
};

class CliqueTree {
 public:
  explicit CliqueTree(graph::FactorGraph& graph);

  /// The variable's clique and all above it will be built anew.
  void mark_structure(int variable);
  /// The factor's clique and all above it will be computed anew.
  void mark_numbers(int factor);
  void mark_everything();
  bool is_marked() const { return !structural_.empty() || !dirty_.empty(); }
  /// Takes a factor out of its clique, which is marked.
  void detach(int factor);

  /// Brings the marked part up to date. `fresh`: factors that no clique holds yet. `last`:
  /// variables to be eliminated as late as possible.
  TreeStatistics eliminate(std::span<const int> fresh, std::span<const int> last);

  /// Parts of a variable's own (conditional) standard deviation.
  struct MoveLimits {
    double finest = 0.0;   ///< What changes by less stays.
    double at_once = 0.0;  ///< What lies below changes that are all smaller waits for its turn.
    int turns = 0;         ///< Cliques that waited and have their turn, in one solve.
  };
  /// Back-substitution from the cliques that eliminate() made, on as long as something changes.
  /// Moves the variables; changed() tells which and changed_from() where from. The far end of a
  /// large map follows the hair's breadths of every update a little later: so an update's cost
  /// does not follow the map.
  void solve(const MoveLimits& limits);
  /// The whole tree; nothing waits.
  void solve_everything(double threshold);
  const std::vector<int>& changed() const { return changed_; }
  const std::vector<graph::Delta>& changed_from() const { return changed_from_; }

  /// Joint covariance of variables in the order given; in their charts. None where one is not in
  /// the tree or the measurements leave one undetermined.
  std::optional<Eigen::MatrixXd> joint_covariance(std::span<const int> variables);

  /// Variables that the measurements leave undetermined.
  std::vector<int> undetermined() const;
  int undetermined_cliques() const { return cliques_[kRoot].left_out; }
  /// Of one factorisation of the whole as it stands.
  double total_flops() const { return total_flops_; }

  void commit();
  void rollback();
  std::size_t bytes() const { return pool_.bytes() + rows_.bytes(); }
  const CliqueRecord& clique(int id) const { return cliques_[id]; }
  int capacity() const { return cliques_.size(); }

  static constexpr int kRoot = 0;  ///< Of all trees; empty.

 private:
  struct Marks {
    std::vector<int> structural;
    std::vector<int> dirty;
    std::vector<int> waiting;
    double total_flops = 0.0;
  };
  /// One front at work: size x size, lower triangle.
  struct Workspace {
    std::vector<double> numbers;
    double* front = nullptr;
    std::vector<int> offset;  ///< Per variable: first row.
    std::vector<double> least;
  };
  enum Mark : char { kClean = 0, kDirty = 1, kStructural = 2 };

  // clique_tree.cpp
  void mark_structure_from(int clique);
  void mark_numbers_from(int clique);
  void clear_marks();
  void free_blocks(const CliqueRecord& clique);
  void link_child(int parent, int child);
  void unlink_from_root(int child);
  void count_left_out(int change);

  // clique_tree_build.cpp
  void collect(std::span<const int> fresh);
  void collect_variable(int variable);
  void take_apart(int clique);
  void build(const CliquePlan& plan);
  int build_clique(const CliquePlan& plan, int planned);
  double remove_structure();

  // clique_tree_eliminate.cpp
  void order_dirty();
  void factorise(int clique);
  int compute(const CliqueRecord& clique, Workspace& at);
  void assemble(const CliqueRecord& clique, Workspace& at);
  void place_rows(const CliqueRecord& clique, Workspace& at) const;
  void add_factors(const CliqueRecord& clique, Workspace& at);
  void add_child(const CliqueRecord& child, Workspace& at, int size);
  template <typename ColumnOf>
  void add_schur(const CliqueRecord& child, const ColumnOf& column_of, Workspace& at, int size);

  // clique_tree_solve.cpp
  void solve_clique(int clique, double finest);
  void solve_from(int clique, const MoveLimits& limits);
  void queue(int clique);
  void forget_waiting();
  void take_slots(const MoveLimits& limits);
  double change_of_rows(const CliqueRecord& clique, int from) const;
  void push_children(int clique, double at_once);

  // clique_tree_covariance.cpp
  void collect_paths(std::span<const int> variables);
  void forward(const CliqueRecord& clique);

  graph::FactorGraph& graph_;
  FrontKernel kernel_;
  storage::JournaledTable<CliqueRecord> cliques_;
  storage::BlockPool<double> pool_;
  storage::BlockPool<int> rows_;
  double total_flops_ = 0.0;

  std::vector<char> mark_;  ///< Per clique.
  std::vector<int> structural_;
  std::vector<int> dirty_;
  std::vector<int> waiting_;      ///< Cliques that changes stopped at, first come first served.
  std::vector<char> is_waiting_;  ///< Per clique; not of those that have left the tree.
  Marks saved_marks_;
  bool solve_everything_ = false;

  // Scratch of one update.
  CliquePlanner planner_;
  std::vector<int> affected_;  ///< Variables whose elimination is planned anew.
  std::vector<int> affected_at_;
  std::vector<int> element_factors_;
  std::vector<int> orphans_;
  std::vector<int> made_;     ///< Cliques computed by the last eliminate(), children first.
  std::vector<int> pending_;  ///< Per clique: dirty children not yet computed.
  std::vector<int> offset_;   ///< Per variable: first row.
  Workspace work_space_;
  Workspace leaf_space_;  ///< Of a child that is computed for its parent's sake.
  std::vector<int> left_out_;
  struct Run {
    int from, to, length;
  };
  std::vector<Run> runs_;
  std::vector<int> targets_;
  std::vector<double> step_;
  std::vector<int> stack_;
  std::vector<int> changed_;
  std::vector<graph::Delta> changed_from_;
  std::vector<std::uint64_t> changed_at_;  ///< Per variable: number of the solve that moved it.
  std::vector<double> change_size_;        ///< And how far [own conditional deviations].
  std::uint64_t solve_count_ = 0;
  std::vector<int> path_;
  std::vector<char> on_path_;
  Eigen::MatrixXd right_;  ///< Rows of the paths' variables.
  Eigen::MatrixXd work_;
};

}  // namespace understory::factor_graph::bayes_tree
