// What is offered: the topics, their schemas, and how they may be dropped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace understory::foxglove {

/// The topics, in the order in which they are listed.
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

/// What a client that is too slow may miss.
enum class Delivery : std::uint8_t {
  kLatest,     ///< Everything but the newest message.
  kEach,       ///< The oldest of many messages.
  kIncrement,  ///< Nothing: a message builds on those before it; after a loss the whole is sent.
};

/// One topic; messages are JSON.
struct Topic {
  TopicId id = TopicId::kPose;
  std::string_view name;         ///< For example /pose.
  std::string_view schema_name;  ///< foxglove.NAME as in `@foxglove/schemas`, or understory.NAME.
  Delivery delivery = Delivery::kLatest;
  bool has_state =
      false;  ///< A client that comes later needs the latest one (Converter::state_of).
};

/// All topics; entry i has TopicId i.
std::span<const Topic> topics();
/// The topic of an id.
const Topic& topic(TopicId id);
/// Its schema (JSON Schema, encoding `jsonschema`); made once.
const std::string& schema_of(TopicId id);

}  // namespace understory::foxglove
