// A graph file handed to the smoother pose by pose.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/files/graph_file.hpp"

namespace understory::eval::experiments::backend {

/// Reads a graph (g2o, TORO or iSAM text). Throws std::runtime_error naming file and line where it
/// is no graph, or not one that its edges hold together. Lines that were passed over are counted on
/// stderr.
factor_graph::files::GraphFile read_graph_file(const std::filesystem::path& file);

/// Hands out a file's factors pose by pose: each pose with all factors to earlier ones.
class Feeder {
 public:
  /// Of this file, which must outlive it.
  explicit Feeder(const factor_graph::files::GraphFile& file);

  /// Number of poses.
  std::size_t poses() const { return factors_at_.size(); }

  /// Adds pose k: placed by the motion from the pose before it, where there is one. Edges that are
  /// attached to what is placed come first; those that are not yet wait, for the next poses where
  /// need be: only one pose is held fast. Throws std::runtime_error where only landmarks tie a pose
  /// to the others.
  void feed(std::size_t k, factor_graph::bayes_tree::IncrementalSmoother& smoother);

  /// The smoother's name of the file's vertex v; none before it is placed.
  std::optional<factor_graph::graph::VariableId> name(std::size_t v) const { return names_[v]; }

 private:
  int last_time(const factor_graph::graph::Factor& factor) const;
  bool is_attached(const factor_graph::graph::Factor& factor) const;
  void add(std::size_t f, factor_graph::bayes_tree::IncrementalSmoother& smoother);
  void sort_by_age(int k);
  void start(std::size_t v, factor_graph::bayes_tree::IncrementalSmoother& smoother);

  const factor_graph::files::GraphFile& file_;
  std::vector<int> times_;  ///< Of each pose; -1 of points.
  std::vector<std::optional<factor_graph::graph::VariableId>> names_;
  std::vector<std::vector<std::size_t>> factors_at_;
  std::vector<std::size_t> waiting_;
  bool has_started_ = false;
};

}  // namespace understory::eval::experiments::backend
