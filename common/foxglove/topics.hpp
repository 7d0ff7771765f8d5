// The offered topics, their schemas, and their rules for dropping.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace understory::foxglove {

/// The topics, in the order of the list.
enum class TopicId : std::uint8_t {
  kTransforms,
  kSubmapTransforms,
  kPose,
  kPath,
  kKeyframes,
  kLandmarks,
  kDetections,
  kScan,
  kSweep,
  kFilterPose,
  kDeadReckoning,
  kReference,
  kTruth,
  kTruthLandmarks,
  kFix,
  kLocalFix,
  kLog,
  kPoseNumbers,
  kUpdateNumbers,
  kFilterNumbers,
  kExistenceNumbers,
  kHealthNumbers,
  kLoopNumbers,
  kImuNumbers,
};
/// Number of topics.
inline constexpr std::size_t kTopics = 24;

/// Messages that a slow client may lose.
enum class Delivery : std::uint8_t {
  kLatest,     ///< Everything but the newest message.
  kEach,       ///< The oldest of many messages.
  kIncrement,  ///< None: a message depends on earlier ones; after a loss the whole state is sent.
};

/// One topic; messages are JSON.
struct Topic {
  TopicId id = TopicId::kPose;
  std::string_view name;         ///< For example /pose.
  std::string_view schema_name;  ///< foxglove.NAME as in `@foxglove/schemas`, or understory.NAME.
  Delivery delivery = Delivery::kLatest;
  bool has_state = false;  ///< A later client needs the latest message (Converter::state_of).
};

/// All topics; entry i has TopicId i.
std::span<const Topic> topics();
/// The topic of an id.
const Topic& topic(TopicId id);
/// The topic's schema (JSON Schema, encoding `jsonschema`); made once.
const std::string& schema_of(TopicId id);

}  // namespace understory::foxglove
