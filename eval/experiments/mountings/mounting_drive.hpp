// A drive with one wrong mounting through the chain, and what HEALTH said of it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "eval/experiments/mountings/mounting_fault.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::eval::experiments::mountings {

/// The readings of a drive: many faults are tried on the same one.
struct ReadingTape {
  std::string path;  ///< circle, meander, square, line: how it leads.
  std::vector<std::variant<model::ImuSample, model::WheelSample, model::PointSweep>> readings;
  std::vector<metrics::StampedPose> truth;  ///< Frame `world`, 50 Hz.
  double moves_at_s = 0.0;                  ///< 0.1 m from where it stood.
};

/// A drive through a forest with a VLP-16, an IMU and wheels, 22 s at rest first; path, slopes and
/// the errors of the sensors follow from the seed. Memory: 3 MB for each second.
ReadingTape record_readings(double length_m, std::uint64_t seed);

/// One channel's poses against the truth and their own covariance.
struct PoseScore {
  std::size_t poses = 0;
  std::size_t outside = 0;      ///< Beyond 3 sigma (99.73 %) of three degrees of freedom.
  double largest_m = 0.0;       ///< Error of the position.
  double largest_sigmas = 0.0;  ///< Root of the largest NEES.

  /// At most one in a hundred is outside: sound drives stay so.
  bool is_inside() const { return 100 * outside <= poses; }
};

/// What one drive showed: `miscalibrated` names a sensor, and so does `input_refused`. Seconds
/// count from the start of motion; before it they are negative.
struct MountingVerdict {
  std::optional<double> named_s;         ///< HEALTH said it of the right sensor.
  std::string named_as;                  ///< "process: channel".
  std::map<std::string, double> blamed;  ///< Other sensors that were called `miscalibrated`, when.
  PoseScore slam;                        ///< Until it was named.
  PoseScore filter;
  std::map<std::string, double> heard;  ///< "process reason channel": when it was first said.
};

/// Drives once; ends 3 s after the right sensor was named, else with the drive.
MountingVerdict drive(const ReadingTape& tape, const MountingFault& fault,
                      const std::filesystem::path& config_dir);

}  // namespace understory::eval::experiments::mountings
