#include "common/story/story_book.hpp"

#include <algorithm>
#include <limits>

#include "common/wire/convert.hpp"

namespace understory::story {
namespace {

/// Memory for landmarks: the rest beside poses and moments.
std::size_t landmark_bytes(const Limits& limits) {
  const std::size_t fixed = LandmarkBook::fixed_bytes(limits) + PoseBook::fixed_bytes(limits);
  return limits.bytes - std::min(limits.bytes, fixed);
}

}  // namespace

Limits Limits::of_a_log() {
  constexpr std::size_t kMany = 100'000'000;
  Limits limits;
  limits.landmarks = 10'000'000;
  limits.looks = limits.probabilities = limits.events = std::numeric_limits<std::uint32_t>::max();
  limits.moments = limits.submaps = limits.poses = limits.keyframes = limits.odometry = kMany;
  limits.bytes = LandmarkBook::fixed_bytes(limits) + PoseBook::fixed_bytes(limits) +
                 std::size_t{8'000'000'000};
  return limits;
}

StoryBook::StoryBook(const Limits& limits)
    : landmarks_(limits, landmark_bytes(limits)), poses_(limits) {}

void StoryBook::take(std::string_view channel, std::span<const std::uint8_t> bytes,
                     std::int64_t received_us) {
  if (channel == "SLAM_POSE") return take_bytes<model::SlamPose>(bytes, received_us);
  if (channel == "SLAM_UPDATE") return take_bytes<model::MapUpdate>(bytes, received_us);
  if (channel == "MAP") return take_bytes<model::WholeMap>(bytes, received_us);
  if (channel == "MAP_DELTA") return take_bytes<model::MapDelta>(bytes, received_us);
  if (channel == "SUBMAP") return take_bytes<model::Submap>(bytes, received_us);
  if (channel == "EXISTENCE") return take_bytes<model::Existence>(bytes, received_us);
  if (channel == "MAP_CORRECTION") return take_bytes<model::MapCorrection>(bytes, received_us);
  if (channel == "KEYFRAME") return take_bytes<model::Keyframe>(bytes, received_us);
  if (channel == "LANDMARKS") return take_bytes<model::LandmarkScan>(bytes, received_us);
  if (channel == "TRACKED_LANDMARKS") return take_bytes<model::TrackedScan>(bytes, received_us);

  if (channel == "ODOMETRY") return take_bytes<model::Odometry>(bytes, received_us);
  if (channel == "EKF_POSE") return take_bytes<model::EkfPose>(bytes, received_us);
  if (channel == "RAW_SCAN") return take_laser<model::PlanarScan>(bytes, true, received_us);
  if (channel == "LIDAR_SCAN") return take_laser<model::PlanarScan>(bytes, false, received_us);
  if (channel == "RAW_SWEEP") return take_laser<model::PointSweep>(bytes, true, received_us);
  if (channel == "LIDAR_SWEEP") return take_laser<model::PointSweep>(bytes, false, received_us);
}

template <class Value>
void StoryBook::take_bytes(std::span<const std::uint8_t> bytes, std::int64_t received_us) {
  const auto value = wire::decode_message<Value>(bytes);
  if (value) return take(*value, received_us);
  ++malformed_;
}

template <class Value>
void StoryBook::take_laser(std::span<const std::uint8_t> bytes, bool is_raw,
                           std::int64_t received_us) {
  const auto value = wire::decode_message<Value>(bytes);
  if (value) return take(*value, is_raw, received_us);
  ++malformed_;
}

}  // namespace understory::story
