// eval loops: a drive among stems that leaves them, comes back and has to know the place again.
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "common/geometry/trajectory_error.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/odometry.hpp"
#include "common/model/stem_frame.hpp"

namespace understory::eval::experiments::loops {

/// How a drive of stem frames becomes inputs.
struct LoopDriveOptions {
  double odometry_percent = 1.0;  ///< Noise of ODOMETRY per axis, of the distance; 1 sigma.
  double odometry_deg = 0.3;      ///< Noise of its heading per frame; 1 sigma.
  double sigma_m = 0.1;           ///< That LANDMARKS state, per axis.
  double view_rad = 2.0 * std::numbers::pi;  ///< Width of the field of view, its middle ahead.
  geometry::TruthSigma truth_sigma;          ///< Of the frames' true poses; for NEES.
  double blind_from = 0.0;  ///< Share of the drive from which on no stem is seen ...
  double blind_to = 0.0;    ///< ... to this.
};

/// The inputs of a drive, with what is true.
struct LoopDrive {
  std::string name;
  std::vector<model::LandmarkScan> scans;  ///< One for each frame.
  std::vector<model::Odometry> odometry;   ///< odometry[i]: from frame i to frame i + 1.
  std::vector<geometry::SE2> truth;        ///< first_T_vehicle of each frame.
  geometry::TruthSigma truth_sigma;        ///< How well it is known.
  /// Which tree each detection is, by frame and detection; -1: none, or not to be told.
  std::vector<std::vector<int>> trees;
  std::size_t tree_count = 0;
  double length_m = 0.0;
  double closing_error_m = 0.0;  ///< Of the last frame by odometry alone.
};

/// The frames as they would be driven. Which detections are one tree follows from the true poses:
/// those within 0.15 m of the mean of those before, or 4.5 standard deviations of what they show
/// (0.7 m at most). The same seed gives the same noise. Throws
/// std::invalid_argument for fewer than two frames.
LoopDrive loop_drive(const std::string& name, const std::vector<model::StemFrame>& frames,
                     const LoopDriveOptions& options, std::uint64_t seed);

}  // namespace understory::eval::experiments::loops
