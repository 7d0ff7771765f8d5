// Writes the lines of a g2o file.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/factor_graph/graph/factor.hpp"

namespace understory::factor_graph::files {

/// Collects vertices and edges as g2o text.
class G2oWriter {
 public:
  /// `digits` of a number.
  explicit G2oWriter(int digits) : digits_(digits) {}

  /// A pose or a point of the plane (as many numbers as its type has). False for other types.
  bool vertex(graph::VariableType type, std::uint64_t number, std::span<const double> value);
  /// Fixes a vertex.
  void fix(std::uint64_t number);
  /// A measurement between two vertices of the plane: relative poses and Cartesian observations of
  /// points. False for other kinds.
  bool edge(graph::FactorKind kind, std::span<const std::uint64_t> vertices,
            std::span<const double> measurement, const Eigen::MatrixXd& information);
  /// The text so far; the writer is empty afterwards.
  std::string take();

 private:
  void number(double value);
  void integer(std::uint64_t value) { out_ += ' ' + std::to_string(value); }

  int digits_;
  std::string out_;
};

}  // namespace understory::factor_graph::files
