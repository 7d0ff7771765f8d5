// The stages on a drive, with the loop closer and without.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "eval/experiments/loops/drive_watch.hpp"
#include "eval/experiments/loops/loop_drive.hpp"

namespace understory::eval::experiments::loops {

/// What became of a drive.
struct LoopScore {
  std::size_t first_frame = 0;  ///< The map begins there.
  std::size_t keyframes = 0;
  std::size_t placed = 0;  ///< By the mapper.
  std::size_t maps = 0;    ///< That it began.
  double error_m = 0.0;    ///< Mean of all keyframes in the final map, first pose held.
  double ate_m = 0.0;      ///< Root mean square of the same after one rigid alignment.
  std::size_t in_map = 0;  ///< Keyframes that the final map holds.
  // Of the loop closer; 0 without it.
  std::size_t queries = 0;
  std::size_t without_match = 0;  ///< Of these: no earlier frame within 20 m, 100 m of path back.
  std::size_t with_match = 0;     ///< Of these: an earlier frame within 5 m.
  std::size_t sent = 0;
  std::size_t unexpected = 0;
  std::size_t sent_wrong = 0;
  std::size_t accepted = 0;  ///< Count at the end.
  std::size_t accepted_wrong = 0;
  std::size_t waiting = 0;
  std::size_t refused = 0;
  double mean_nees = 0.0;  ///< Of the relative poses sent; 3 is exact.
  double search_ms_p50 = 0.0;
  double search_ms_p99 = 0.0;
  double mapper_ms_p99 = 0.0;
  double largest_closure_ms = 0.0;
  DriveFate fate;
};

/// Runs keyframer and mapper, configured by the folder, and the loop closer where it is wanted.
/// The same drive gives the same score but for the times.
LoopScore run_drive(const LoopDrive& drive, const std::filesystem::path& config_dir,
                    bool with_loop_closer);

/// The loop closer alone, beside a mapper that only reckons by odometry and finds no landmark
/// again: many queries in short time. Nothing is accepted.
LoopScore reckon_drive(const LoopDrive& drive, const std::filesystem::path& config_dir);

/// Mean error [m] and error after alignment [m] of poses that are given for some frames.
struct PathErrors {
  double mean_m = 0.0;
  double ate_m = 0.0;
};
/// `frames`: which of the drive's frames the poses are of.
PathErrors path_errors(const LoopDrive& drive, const std::vector<std::size_t>& frames,
                       const std::vector<geometry::SE2>& poses);

}  // namespace understory::eval::experiments::loops
