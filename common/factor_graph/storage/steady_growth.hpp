// Tables that grow without doubling.
#pragma once

#include <cstddef>
#include <vector>

namespace understory::factor_graph::storage {

/// Makes room for one more entry; a full table grows by a quarter, so a table that needs slightly
/// more than before grows only a little.
template <typename T>
void make_room(std::vector<T>& table) {
  constexpr std::size_t kFewest = 16;
  if (table.size() == table.capacity()) table.reserve(table.size() + table.size() / 4 + kFewest);
}

}  // namespace understory::factor_graph::storage
