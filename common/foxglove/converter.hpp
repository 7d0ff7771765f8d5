// Messages of the bus as messages of the schemas that Foxglove and Lichtblick know.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/foxglove/topics.hpp"

namespace understory::foxglove {

/// One message, ready for a file or a client.
struct Converted {
  TopicId topic = TopicId::kPose;
  std::uint64_t log_time_ns = 0;      ///< When the message that it comes from was received.
  std::uint64_t publish_time_ns = 0;  ///< Stamp of the measurement; of HEALTH the wall clock.
  /// Clients that wait share the text. Never null.
  std::shared_ptr<const std::string> json;
};

/// What a converter keeps at most, and how much it tells of what is large.
struct Limits {
  std::size_t landmarks = 200'000;   ///< Of the map.
  std::size_t path_poses = 600;      ///< Of /pose/path and of /map/keyframes.
  std::int64_t path_us = 2'000'000;  ///< From one path to the next.
  std::size_t sweep_points = 30'000;
};

/// Pure: no clock, no file, no bus. Bytes are checked as everywhere (`wire::decode_message`); what
/// does not pass is counted and passed over. Memory: the landmarks (150 bytes each), the latest
/// message of topics with state, two revolutions of the laser. Cost: O(what changed), but for
/// /pose/path, which is written whole every 2 s, and MAP.
class Converter {
 public:
  /// With bounds.
  explicit Converter(const Limits& limits = {});
  ~Converter();
  Converter(const Converter&) = delete;
  Converter& operator=(const Converter&) = delete;

  /// Takes a message of a channel, received at `received_utime` [us]; gives what it says, in order
  /// of topic. Channels without a topic give nothing.
  std::vector<Converted> take(std::string_view channel, std::span<const std::uint8_t> bytes,
                              std::int64_t received_utime);
  /// What a client that comes now needs of a topic with state (`Topic::has_state`): the latest
  /// message; of landmarks the whole scene, O(map). None where there is nothing yet.
  std::optional<Converted> state_of(TopicId topic) const;
  /// Whether anything is made from messages of this channel.
  static bool takes(std::string_view channel);
  /// Messages that were refused.
  std::uint64_t refused() const;
  /// Landmarks beyond the limit.
  std::uint64_t landmarks_left_out() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::foxglove
