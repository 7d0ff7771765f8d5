// A process that hangs or a sensor that is silent for a while: what becomes of the poses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace understory::eval::experiments::gaps {

/// What is missing, and for how long.
struct Gap {
  std::string what;     ///< For people.
  std::string service;  ///< That hears nothing; "all" of them; empty = a sensor is silent.
  std::string channel;  ///< On which nothing comes; empty = a process hangs.
  double seconds = 0.0;
};

/// No gap, and each process and each sensor for 1.1, 3, 6 and 30 s.
std::vector<Gap> all_gaps();

/// What a gap did to the poses of one channel.
struct PosesAroundGap {
  bool goes_on = false;       ///< A localised pose came after the gap.
  double waited_s = 0.0;      ///< From its end to that pose.
  bool is_announced = false;  ///< By `reset_counter`, or by another map.
  bool is_new_map = false;
  double step_m = 0.0;  ///< By which the error changed over the gap, in the same map.
  /// Of that pose, by its own covariance (3 degrees of freedom); none in a new map, which begins
  /// with it.
  std::optional<double> nees;
  /// RMS error outside of the gap [m], each stretch between announced jumps aligned by itself.
  double rms_m = 0.0;
};

/// Both poses of one drive.
struct GapScore {
  PosesAroundGap ekf;
  PosesAroundGap slam;
};

/// How a drive goes.
struct GapDrive {
  std::filesystem::path config_dir = "deploy/config/lidar";
  double length_m = 300.0;
  bool is_vlp16 = true;
};

/// Drives once through a simulated forest; the gap begins somewhere between the 27th and the 42nd
/// second, always at the same time for a seed. Throws what drive_chain() throws.
GapScore drive(const GapDrive& drive, const Gap& gap, std::uint64_t seed);

}  // namespace understory::eval::experiments::gaps
