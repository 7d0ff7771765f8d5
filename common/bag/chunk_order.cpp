#include "common/bag/chunk_order.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace understory::bag {

ChunkOrder::ChunkOrder(std::vector<ChunkSpan> spans, Load load, IsWanted is_wanted,
                       std::size_t most_bytes)
    : spans_(std::move(spans)),
      load_(std::move(load)),
      is_wanted_(std::move(is_wanted)),
      most_bytes_(most_bytes),
      order_(spans_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return spans_[i].start_ns; });
}

void ChunkOrder::load(Open& open) {
  open.chunk = load_(open.number);
  ++loads_;
  std::erase_if(open.chunk.entries,
                [&](const ChunkEntry& entry) { return !is_wanted_(entry.channel); });
  std::ranges::stable_sort(open.chunk.entries, {}, &ChunkEntry::time_ns);
  open.is_loaded = true;
  bytes_ += open.chunk.bytes.size();
}

void ChunkOrder::make_room() {
  // The first one is due: keep it.
  for (auto at = open_.rbegin(); bytes_ > most_bytes_ && at != std::prev(open_.rend()); ++at) {
    Open& open = at->second;
    if (!open.is_loaded) continue;
    bytes_ -= open.chunk.bytes.size();
    open.chunk = {};
    open.is_loaded = false;
  }
}

void ChunkOrder::open_due() {
  while (next_chunk_ < order_.size()) {
    const std::size_t number = order_[next_chunk_];
    if (!open_.empty() && spans_[number].start_ns > open_.begin()->first.first) return;
    ++next_chunk_;
    Open open;
    open.number = number;
    load(open);

    if (open.chunk.entries.empty()) {
      bytes_ -= open.chunk.bytes.size();
      continue;
    }

    const Key key{open.chunk.entries.front().time_ns, number};
    open_.emplace(key, std::move(open));
    make_room();
  }
}

std::optional<ChunkOrder::Item> ChunkOrder::next() {
  if (given_) {
    bytes_ -= given_->chunk.bytes.size();
    given_.reset();
  }
  open_due();
  if (open_.empty()) return std::nullopt;

  auto node = open_.extract(open_.begin());
  Open& open = node.mapped();
  if (!open.is_loaded) {
    load(open);
    make_room();
  }

  // The file has changed meanwhile.
  if (open.next >= open.chunk.entries.size()) return next();
  const ChunkEntry entry = open.chunk.entries[open.next++];
  const auto data =
      std::span<const std::uint8_t>(open.chunk.bytes).subspan(entry.offset, entry.size);
  if (open.next == open.chunk.entries.size()) {
    given_ = std::move(open);
    return Item{entry, data};
  }

  node.key().first = open.chunk.entries[open.next].time_ns;
  open_.insert(std::move(node));
  return Item{entry, data};
}

}  // namespace understory::bag
