// A factor graph copied by its public face.
#pragma once

#include <algorithm>
#include <map>

#include "common/factor_graph/factor_graph.hpp"

namespace understory {

/// A graph of its own with the smoother's variables and factors.
struct GraphCopy {
  explicit GraphCopy(const FactorGraph& from) {
    for (int v = 0; v < from.variable_capacity(); ++v) {
      if (from.contains(VariableId(v))) {
        names[v] = graph.add(from.type(VariableId(v)), from.value(VariableId(v)));
      }
    }
    for (int f = 0; f < from.factor_capacity(); ++f) {
      if (!from.contains(FactorId(f))) continue;
      Factor factor;
      factor.kind = from.kind(FactorId(f));
      const auto variables = from.variables_of(f);
      factor.variable_count = static_cast<int>(variables.size());
      for (std::size_t i = 0; i < variables.size(); ++i) {
        factor.variables[i] = names.at(variables[i]);
      }
      const auto measurement = from.measurement(FactorId(f));
      std::copy(measurement.begin(), measurement.end(), factor.measurement.begin());
      factor.information = from.information(FactorId(f));
      factor.loss = from.loss(FactorId(f));
      graph.add(factor);
    }
  }
  FactorGraph graph;
  std::map<int, VariableId> names;
};

}  // namespace understory
