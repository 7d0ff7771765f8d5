// A graph as g2o text.
#include <charconv>

#include "common/factor_graph/files/graph_file.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::files {
namespace {

/// Words and numbers; the shortest digits that read back as the same number.
class Text {
 public:
  void word(std::string_view text) { out_ += text; }
  void number(double value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    out_ += ' ';
    out_.append(digits, end);
  }
  void integer(int value) { out_ += ' ' + std::to_string(value); }
  void upper_triangle(const Eigen::MatrixXd& m) {
    for (Eigen::Index r = 0; r < m.rows(); ++r) {
      for (Eigen::Index c = r; c < m.cols(); ++c) number(m(r, c));
    }
  }
  void end() { out_ += '\n'; }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

/// False where g2o has no tag for it.
bool write_vertex(const graph::FactorGraph& graph, int v, Text& out) {
  const graph::Value& value = graph.value(graph::VariableId(v));
  const graph::VariableType type = graph.type(graph::VariableId(v));
  std::size_t numbers = static_cast<std::size_t>(dimension(type));
  switch (type) {
    case graph::VariableType::kPose2:
      out.word("VERTEX_SE2");
      break;
    case graph::VariableType::kPoint2:
      out.word("VERTEX_XY");
      break;
    case graph::VariableType::kPose3:
      out.word("VERTEX_SE3:QUAT");
      numbers = 7;
      break;
    case graph::VariableType::kPoint3:
      out.word("VERTEX_TRACKXYZ");
      break;
    case graph::VariableType::kScalar:
      return false;
  }

  out.integer(v);
  for (std::size_t i = 0; i < numbers; ++i) out.number(value[i]);
  out.end();
  return true;
}

/// False where g2o has no tag for it.
bool write_edge(const graph::FactorGraph& graph, int f, Text& out) {
  const graph::FactorKind kind = graph.kind(graph::FactorId(f));
  std::size_t numbers = 0;
  switch (kind) {
    case graph::FactorKind::kRelativePose2:
      out.word("EDGE_SE2");
      numbers = 3;
      break;
    case graph::FactorKind::kPoint2:
      out.word("EDGE_SE2_XY");
      numbers = 2;
      break;
    case graph::FactorKind::kRelativePose3:
      out.word("EDGE_SE3:QUAT");
      numbers = 7;
      break;
    case graph::FactorKind::kPoint3:
      out.word("EDGE_SE3_TRACKXYZ");
      numbers = 3;
      break;
    default:
      return false;
  }

  for (const int v : graph.variables_of(f)) out.integer(v);
  if (kind == graph::FactorKind::kPoint3) out.integer(0);
  const auto measurement = graph.measurement(graph::FactorId(f));
  for (std::size_t i = 0; i < numbers; ++i) out.number(measurement[i]);

  Eigen::MatrixXd information = graph.information(graph::FactorId(f));
  if (kind == graph::FactorKind::kRelativePose3) {
    // Of the quaternion's vector part, half the rotation vector.
    information.bottomRows(3) *= 2.0;
    information.rightCols(3) *= 2.0;
  }
  out.upper_triangle(information);
  out.end();
  return true;
}

}  // namespace

std::string write_g2o(const graph::FactorGraph& graph, int* skipped) {
  Text out;
  int left_out = 0;
  bool has_sensor = false;
  for (int v = 0; v < graph.variable_capacity(); ++v) {
    if (!graph.contains(graph::VariableId(v))) continue;
    if (!write_vertex(graph, v, out)) ++left_out;
    has_sensor = has_sensor || graph.type(graph::VariableId(v)) == graph::VariableType::kPoint3;
  }
  if (has_sensor) out.word("PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n");
  for (int f = 0; f < graph.factor_capacity(); ++f) {
    if (graph.contains(graph::FactorId(f)) && !write_edge(graph, f, out)) ++left_out;
  }
  if (skipped != nullptr) *skipped = left_out;
  return out.take();
}

}  // namespace understory::factor_graph::files
