// Writes the lines of a g2o file.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/factor_graph/graph/factor.hpp"

namespace understory::factor_graph::files {

/// Collects vertices and edges as g2o text.
class G2oWriter {
 public:
  /// `digits` of a number; none = the fewest that read back as the same number.
  explicit G2oWriter(std::optional<int> digits = std::nullopt) : digits_(digits) {}

  /// A variable at its value (as many numbers as its type has; of 3-D poses position and
  /// quaternion x, y, z, w). False where g2o has no tag for it.
  bool vertex(graph::VariableType type, std::uint64_t number, std::span<const double> value);
  /// Fixes a vertex.
  void fix(std::uint64_t number);
  /// A measurement between two vertices: relative poses and Cartesian observations of points.
  /// `information` of a rotation is of its rotation vector. False where g2o has no tag for it.
  bool edge(graph::FactorKind kind, std::span<const std::uint64_t> vertices,
            std::span<const double> measurement, Eigen::MatrixXd information);
  /// The sensor that observations of 3-D points refer to, at the vehicle's origin; once, before
  /// such edges.
  void sensor_at_origin() { out_ += "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n"; }

  /// The text so far; the writer is empty afterwards.
  std::string take();

 private:
  void number(double value);
  void integer(std::uint64_t value) { out_ += ' ' + std::to_string(value); }

  std::optional<int> digits_;
  std::string out_;
};

}  // namespace understory::factor_graph::files
