#include "common/foxglove/waiting_line.hpp"

#include <utility>

namespace understory::foxglove {

std::uint64_t WaitingLine::offer(const Converted& message, std::uint64_t turn,
                                 const LineBounds& bounds) {
  const std::size_t bytes = message.json->size();
  std::uint64_t dropped = 0;
  switch (topic(message.topic).delivery) {
    case Delivery::kLatest:
      if (!queue_.empty())
        turn = queue_.front().turn;  // It keeps the place of the replaced message.
      dropped = clear();
      break;
    case Delivery::kEach:
      dropped = make_room(bytes, bounds);
      break;
    case Delivery::kIncrement:
      // The whole state, which follows, includes it.
      if (needs_state_) return 0;
      if (!is_full_for(bytes, bounds)) break;
      needs_state_ = true;
      is_after_loss_ = true;
      return clear() + 1;
  }

  bytes_ += bytes;
  queue_.push_back({turn, message});
  return dropped;
}

std::optional<std::uint64_t> WaitingLine::turn() const {
  if (queue_.empty()) return std::nullopt;
  return queue_.front().turn;
}

Converted WaitingLine::pop() {
  Converted message = std::move(queue_.front().message);
  queue_.pop_front();
  bytes_ -= message.json->size();
  return message;
}

bool WaitingLine::expect_state() {
  needs_state_ = false;
  return std::exchange(is_after_loss_, false);
}

bool WaitingLine::is_full_for(std::size_t bytes, const LineBounds& bounds) const {
  return !queue_.empty() && (queue_.size() >= bounds.messages || bytes_ + bytes > bounds.bytes);
}

std::uint64_t WaitingLine::make_room(std::size_t bytes, const LineBounds& bounds) {
  std::uint64_t dropped = 0;
  for (; is_full_for(bytes, bounds); ++dropped) pop();
  return dropped;
}

std::uint64_t WaitingLine::clear() {
  const std::uint64_t dropped = queue_.size();
  queue_.clear();
  bytes_ = 0;
  return dropped;
}

}  // namespace understory::foxglove
