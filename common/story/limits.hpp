// Limits of the stored history.
#pragma once

#include <cstddef>
#include <cstdint>

namespace understory::story {

/// Limits of a StoryBook. The defaults are for a process that runs for days: less than 64 MB, the
/// latest ten minutes of poses at 10 Hz.
struct Limits {
  std::size_t bytes = 64'000'000;     ///< Total memory; if it is too small, `landmarks` is reduced.
  std::size_t landmarks = 100'000;    ///< The least recently used landmark is dropped first.
  std::uint32_t looks = 1024;         ///< Per landmark: keyframes that saw or missed it.
  std::uint32_t probabilities = 512;  ///< Values of the probability per landmark.
  std::uint32_t events = 64;          ///< Per landmark: births, merges, ...
  std::size_t moments = 40'000;       ///< Keyframes referenced by looks and events.
  std::size_t submaps = 10'000;       ///< Submaps that were handed over.
  /// SLAM_POSE, and messages of every channel with one message per scan.
  std::size_t poses = 6000;
  std::size_t keyframes = 3000;   ///< KEYFRAME and SLAM_UPDATE.
  std::size_t odometry = 20'000;  ///< Increments.

  /// For reading a whole log: nothing is dropped below 8 GB.
  static Limits of_a_log();
};

}  // namespace understory::story
