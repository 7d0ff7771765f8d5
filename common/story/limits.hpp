// How much is remembered.
#pragma once

#include <cstddef>
#include <cstdint>

namespace understory::story {

/// What a StoryBook keeps at most. The defaults are for a process that runs for days: less than 64
/// MB, the latest ten minutes of poses at 10 Hz.
struct Limits {
  std::size_t bytes = 64'000'000;     ///< In all; where it is too little, `landmarks` is lowered.
  std::size_t landmarks = 100'000;    ///< The one that was not spoken of for longest goes first.
  std::uint32_t looks = 1024;         ///< Of one landmark: keyframes that saw or missed it.
  std::uint32_t probabilities = 512;  ///< Of one landmark.
  std::uint32_t events = 64;          ///< Of one landmark: births, merges, ...
  std::size_t moments = 40'000;       ///< Keyframes to which looks and events refer.
  std::size_t submaps = 10'000;       ///< Submaps that were handed over.
  std::size_t poses = 6000;           ///< SLAM_POSE, and of every channel of one message a scan.
  std::size_t keyframes = 3000;       ///< KEYFRAME and SLAM_UPDATE.
  std::size_t odometry = 20'000;      ///< Increments.

  /// For a log that is read from end to end: nothing is forgotten before 8 GB.
  static Limits of_a_log();
};

}  // namespace understory::story
