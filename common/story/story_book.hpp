// Explains the origin of a landmark or a pose from the messages on the bus.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/story/landmark_book.hpp"
#include "common/story/pose_book.hpp"
#include "common/story/tell.hpp"

namespace understory::story {

/// Stores messages in bounded memory and reports their content on one landmark or one pose.
///
/// Pure: it has no clock; a reception time is a value like others. One thread. Text is made on
/// request. Each message costs O(its content).
class StoryBook {
 public:
  /// An empty book.
  explicit StoryBook(const Limits& limits = {});

  /// Takes a message as it came, of any version; what is malformed is counted and passed over, and
  /// so are other channels. `received_us` is the wall clock when it came, 0 where not known.
  void take(std::string_view channel, std::span<const std::uint8_t> bytes,
            std::int64_t received_us);

  /// Takes a decoded value; for sweeps and scans see the overloads with their channel.
  template <class Value>
  void take(const Value& value, std::int64_t received_us) {
    starts_with(value.utime);
    if constexpr (requires { landmarks_.take(value); }) landmarks_.take(value);
    if constexpr (requires { poses_.take(value, received_us); }) poses_.take(value, received_us);
  }
  /// Takes RAW_SCAN (`is_raw`) or LIDAR_SCAN.
  void take(const model::PlanarScan& scan, bool is_raw, std::int64_t received_us) {
    starts_with(scan.utime);
    poses_.take(scan, is_raw, received_us);
  }
  /// Takes a part of RAW_SWEEP (`is_raw`) or LIDAR_SWEEP.
  void take(const model::PointSweep& part, bool is_raw, std::int64_t received_us) {
    starts_with(part.utime);
    poses_.take(part, is_raw, received_us);
  }

  /// The story of a landmark.
  Answer landmark(model::LandmarkId id) const { return tell_landmark(landmarks_, id, start()); }
  /// The story of a pose.
  Answer pose(const PoseQuestion& question) const { return tell_pose(poses_, question, start()); }

  /// The first stamp: origin of times in texts; 0 before the first one.
  model::Utime start() const { return start_.value_or(0); }
  /// Messages of these channels that could not be decoded.
  std::uint64_t malformed() const { return malformed_; }
  const LandmarkBook& landmarks() const { return landmarks_; }  ///< Access for statistics.
  const PoseBook& poses() const { return poses_; }              ///< Access for statistics.
  /// Memory held [bytes], with the allocator's overhead. O(stored messages).
  std::size_t bytes() const { return landmarks_.bytes() + poses_.bytes(); }

 private:
  template <class Value>
  void take_bytes(std::span<const std::uint8_t> bytes, std::int64_t received_us);
  template <class Value>
  void take_laser(std::span<const std::uint8_t> bytes, bool is_raw, std::int64_t received_us);
  void starts_with(model::Utime utime) {
    if (!start_) start_ = utime;
  }

  LandmarkBook landmarks_;
  PoseBook poses_;
  std::optional<model::Utime> start_;
  std::uint64_t malformed_ = 0;
};

}  // namespace understory::story
