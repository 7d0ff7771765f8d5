// The store's parameters as a configuration file has them.
#pragma once

#include "common/bus/parameter_table.hpp"
#include "services/submap_store/parameters.hpp"

namespace understory::submap_store {

/// Lists them in `table`, bound to `parameters`, which must outlive it.
void describe(StoreParameters& parameters, bus::ParameterTable& table);

}  // namespace understory::submap_store
