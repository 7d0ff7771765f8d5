// Converts messages of the bus to the schemas of Foxglove and Lichtblick.
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
  std::uint64_t log_time_ns = 0;      ///< Reception time of the source message.
  std::uint64_t publish_time_ns = 0;  ///< Stamp of the measurement; of HEALTH the wall clock.
  /// Waiting clients share the text. Never null.
  std::shared_ptr<const std::string> json;
};

/// Limits of a converter's memory and of large messages.
struct Limits {
  std::size_t landmarks = 200'000;   ///< Landmarks of the map.
  std::size_t path_poses = 600;      ///< Poses of /pose/path and of /map/keyframes.
  std::int64_t path_us = 2'000'000;  ///< Interval between two paths.
  std::size_t sweep_points = 30'000;
};

/// Pure: no clock, no file, no bus. Bytes are checked by `wire::decode_message`; refused messages
/// are counted and skipped. Memory: the landmarks (150 bytes each), the latest message of topics
/// with state, two revolutions of the laser. Cost: O(changes), except for MAP and for /pose/path,
/// which is written completely every 2 s.
class Converter {
 public:
  /// A converter with these limits.
  explicit Converter(const Limits& limits = {});
  ~Converter();
  Converter(const Converter&) = delete;
  Converter& operator=(const Converter&) = delete;

  /// Takes a message of a channel, received at `received_utime` [us]; returns the resulting
  /// messages in order of topic; none for channels without a topic.
  std::vector<Converted> take(std::string_view channel, std::span<const std::uint8_t> bytes,
                              std::int64_t received_utime);
  /// The message that a new client needs of a topic with state (`Topic::has_state`): the latest
  /// one; for landmarks the whole scene, O(map). None where there is no message yet.
  std::optional<Converted> state_of(TopicId topic) const;
  /// Whether anything is made from messages of this channel.
  static bool takes(std::string_view channel);
  /// Messages that were refused.
  std::uint64_t refused() const;
  /// Number of landmarks beyond the limit.
  std::uint64_t landmarks_left_out() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::foxglove
