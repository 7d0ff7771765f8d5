// Output of a converter: the present messages, and the latest of topics with state.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/foxglove/converter.hpp"
#include "common/foxglove/scene.hpp"

namespace understory::foxglove {

/// The messages that the one in hand leads to, and the latest of topics with state.
class Outbox {
 public:
  /// Begins with another message of the bus, received at `received_utime` [us].
  void begin(std::int64_t received_utime) {
    messages_.clear();
    received_utime_ = received_utime;
  }
  /// Gives a message of a topic, with the stamp `utime`.
  void give(TopicId id, model::Utime utime, std::string json) {
    messages_.push_back(made(id, utime, std::move(json)));
    if (keeps(id)) latest_[static_cast<std::size_t>(id)] = messages_.back();
  }
  /// Makes a message without putting it out.
  Converted made(TopicId id, model::Utime utime, std::string json) const {
    return {id, nanoseconds(received_utime_), nanoseconds(utime),
            std::make_shared<const std::string>(std::move(json))};
  }
  /// All messages since begin(), in order of topic.
  std::vector<Converted> take();

  /// The latest message of a topic with state; none for landmarks, whose messages are increments.
  const std::optional<Converted>& latest(TopicId id) const {
    return latest_[static_cast<std::size_t>(id)];
  }
  /// When the message in hand was received [us].
  std::int64_t received_utime() const { return received_utime_; }

 private:
  static bool keeps(TopicId id) {
    return topic(id).has_state && topic(id).delivery != Delivery::kIncrement;
  }

  std::vector<Converted> messages_;
  std::array<std::optional<Converted>, kTopics> latest_;
  std::int64_t received_utime_ = 0;
};

}  // namespace understory::foxglove
