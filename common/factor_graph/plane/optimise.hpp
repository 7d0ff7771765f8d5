// Batch solution of a graph in the plane.
#pragma once

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/plane/graph.hpp"

namespace understory::factor_graph::plane {

/// Moves the graph's values to their local optimum; variables without factors stay. After an error
/// the values are the last good ones. Costs some factorisations of the whole graph.
batch::BatchReport optimise(Graph& graph, const batch::BatchParameters& parameters = {});

}  // namespace understory::factor_graph::plane
