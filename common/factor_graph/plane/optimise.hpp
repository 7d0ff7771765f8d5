// A graph of the plane solved whole.
#pragma once

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/plane/graph.hpp"

namespace understory::factor_graph::plane {

/// Moves the graph's values to the optimum that they lead to; what has no factor stays. On an error
/// the values are the last good ones. Costs some factorisations of the whole.
batch::BatchReport optimise(Graph& graph, const batch::BatchParameters& parameters = {});

}  // namespace understory::factor_graph::plane
