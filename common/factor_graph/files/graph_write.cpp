// A graph as g2o text.
#include "common/factor_graph/files/g2o_writer.hpp"
#include "common/factor_graph/files/graph_file.hpp"
#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::factor_graph::files {

std::string write_g2o(const graph::FactorGraph& graph, int* skipped) {
  G2oWriter out;
  int left_out = 0;
  bool has_sensor = false;
  for (int v = 0; v < graph.variable_capacity(); ++v) {
    const auto id = graph::VariableId(v);
    if (!graph.contains(id)) continue;
    if (!out.vertex(graph.type(id), static_cast<std::uint64_t>(v), graph.value(id))) ++left_out;
    has_sensor = has_sensor || graph.type(id) == graph::VariableType::kPoint3;
  }
  if (has_sensor) out.sensor_at_origin();

  for (int f = 0; f < graph.factor_capacity(); ++f) {
    const auto id = graph::FactorId(f);
    if (!graph.contains(id)) continue;
    const auto variables = graph.variables_of(f);
    const std::vector<std::uint64_t> vertices(variables.begin(), variables.end());
    if (!out.edge(graph.kind(id), vertices, graph.measurement(id), graph.information(id)))
      ++left_out;
  }
  if (skipped != nullptr) *skipped = left_out;
  return out.take();
}

}  // namespace understory::factor_graph::files
