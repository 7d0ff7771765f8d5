#include "common/bus/partial_message.hpp"

#include <algorithm>
#include <iterator>

namespace understory::bus {
namespace {

/// Bytes of a map node, its vector and the allocator's overhead for both, rounded up.
constexpr std::size_t kPartOverhead = 128;

}  // namespace

PartialMessage::PartialMessage(const Fragment& first)
    : message_size_(first.message_size),
      count_(first.count),
      has_come_(first.count, false),
      held_bytes_(sizeof(PartialMessage) + kPartOverhead + first.count / 8) {}

std::optional<DatagramFault> PartialMessage::check(const Fragment& fragment) const {
  if (fragment.message_size != message_size_ || fragment.count != count_) {
    return DatagramFault::kContradictory;
  }
  if (has_come_[fragment.number]) {
    return is_identical(fragment) ? DatagramFault::kRepeated : DatagramFault::kContradictory;
  }
  if (fragment.payload.empty()) return std::nullopt;

  const auto after = parts_.lower_bound(fragment.offset);
  if (after != parts_.end() && after->first - fragment.offset < fragment.payload.size()) {
    return DatagramFault::kOverlapping;
  }
  if (after == parts_.begin()) return std::nullopt;
  const auto& [offset, part] = *std::prev(after);
  if (fragment.offset - offset < part.size()) return DatagramFault::kOverlapping;
  return std::nullopt;
}

/// True where the same bytes were received before at the same offset.
bool PartialMessage::is_identical(const Fragment& fragment) const {
  if (fragment.number == 0 && fragment.channel != channel_) return false;
  if (fragment.payload.empty()) return true;
  const auto part = parts_.find(fragment.offset);
  return part != parts_.end() && std::ranges::equal(part->second, fragment.payload);
}

void PartialMessage::add(const Fragment& fragment, std::int64_t now_us) {
  // Allocate first: if this fails, nothing has changed.
  if (!fragment.payload.empty()) {
    parts_.try_emplace(fragment.offset, fragment.payload.begin(), fragment.payload.end());
  }
  if (fragment.number == 0) channel_ = fragment.channel;

  has_come_[fragment.number] = true;
  ++fragments_;
  payload_bytes_ += fragment.payload.size();
  held_bytes_ += cost(fragment);
  touched_us_ = now_us;
}

std::vector<std::uint8_t> PartialMessage::take_payload() {
  if (parts_.size() == 1) {
    std::vector<std::uint8_t> only = std::move(parts_.begin()->second);
    parts_.clear();
    return only;
  }

  // Each part is freed as soon as it is copied: the message is never in memory twice.
  std::vector<std::uint8_t> payload;
  payload.reserve(payload_bytes_);
  while (!parts_.empty()) {
    const auto first = parts_.begin();
    payload.insert(payload.end(), first->second.begin(), first->second.end());
    parts_.erase(first);
  }
  return payload;
}

std::size_t PartialMessage::cost(const Fragment& fragment) {
  return fragment.payload.size() + kPartOverhead;
}

}  // namespace understory::bus
