#include "common/foxglove/outbox.hpp"

#include <algorithm>
#include <utility>

namespace understory::foxglove {

std::vector<Converted> Outbox::take() {
  std::ranges::stable_sort(messages_, {}, &Converted::topic);
  return std::exchange(messages_, {});
}

}  // namespace understory::foxglove
