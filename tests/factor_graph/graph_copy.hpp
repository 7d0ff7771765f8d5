// A factor graph copied by its public face.
#pragma once

#include <algorithm>
#include <map>

#include "common/factor_graph/graph/factor_graph.hpp"

namespace understory::test {

/// A graph of its own with the smoother's variables and factors.
struct GraphCopy {
  explicit GraphCopy(const factor_graph::graph::FactorGraph& from) {
    for (int v = 0; v < from.variable_capacity(); ++v) {
      if (from.contains(factor_graph::graph::VariableId(v))) {
        names[v] = graph.add(from.type(factor_graph::graph::VariableId(v)),
                             from.value(factor_graph::graph::VariableId(v)));
      }
    }
    for (int f = 0; f < from.factor_capacity(); ++f) {
      if (!from.contains(factor_graph::graph::FactorId(f))) continue;
      factor_graph::graph::Factor factor;
      factor.kind = from.kind(factor_graph::graph::FactorId(f));
      const auto variables = from.variables_of(f);
      factor.variable_count = static_cast<int>(variables.size());
      for (std::size_t i = 0; i < variables.size(); ++i) {
        factor.variables[i] = names.at(variables[i]);
      }
      const auto measurement = from.measurement(factor_graph::graph::FactorId(f));
      std::copy(measurement.begin(), measurement.end(), factor.measurement.begin());
      factor.information = from.information(factor_graph::graph::FactorId(f));
      factor.loss = from.loss(factor_graph::graph::FactorId(f));
      graph.add(factor);
    }
  }
  factor_graph::graph::FactorGraph graph;
  std::map<int, factor_graph::graph::VariableId> names;
};

}  // namespace understory::test
