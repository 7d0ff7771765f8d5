// Drives as frames for place recognition, with the truth: simulated and recorded ones.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/place_frame.hpp"

namespace understory::eval::experiments::loop_detectors {

/// One drive. The id of a frame is its index.
struct FrameSet {
  std::string name;
  bool has_clouds = false;
  std::vector<understory::place_recognition::PlaceFrame> frames;
  std::vector<geometry::SE2> world_T_level;  ///< The truth, of each frame.
};

/// How a set is made.
struct SetOptions {
  std::uint64_t seed = 1;
  double length_m = 1000.0;  ///< Of simulated ways; recorded ones are as long as they are.
  int jobs = 1;
  int cloud_points = 1000;  ///< Most of a simulated sweep's cloud, as PLACE_SCAN carries it.
};

/// A simulated forest, a way that wanders through it and crosses itself; a sweep of 32 beams every
/// 3 m through the landmark extractor. Throws terminal::Interrupted when `stop` turns true.
FrameSet forest_set(const SetOptions& options, const std::atomic<bool>& stop);
/// The simulated residential block (thesis 002 §3.1), driven round twice; likewise.
FrameSet town_set(const SetOptions& options, const std::atomic<bool>& stop);

/// A surveyed stem map, driven through on a wandering way; frames of detected stems
/// (sim/stem_frames.hpp: two visits have 64 % of the stems in common). `diameter_cm`: the column of
/// diameters in cm, or none. Throws std::runtime_error naming the file.
FrameSet stem_map_set(const std::filesystem::path& file, std::string_view diameter_cm,
                      const SetOptions& options);

/// The poles of KITTI 00 along the recorded trajectory, detected as the stems of a stem map are,
/// up to 40 m away. Throws likewise.
FrameSet kitti_poles_set(const std::filesystem::path& folder, const SetOptions& options);

/// The Victoria Park recording: trunks of the laser, and its returns as the cloud, every 2 m. The
/// truth is the trajectory of this project's own mapper, 1 to 3 m from the satellite fixes; a
/// revisit within 5 m is judged by it. Throws io::DataError.
FrameSet victoria_park_set(const std::filesystem::path& recording, const std::atomic<bool>& stop);

}  // namespace understory::eval::experiments::loop_detectors
