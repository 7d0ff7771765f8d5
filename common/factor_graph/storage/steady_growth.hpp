// Tables that grow without doubling.
#pragma once

#include <cstddef>
#include <vector>

namespace understory::factor_graph::storage {

/// Makes room for one more entry: a quarter more, where there is none. A table that has reached its
/// working set and once needs a little more takes a little more.
template <typename T>
void make_room(std::vector<T>& table) {
  constexpr std::size_t kFewest = 16;
  if (table.size() == table.capacity()) table.reserve(table.size() + table.size() / 4 + kFewest);
}

}  // namespace understory::factor_graph::storage
