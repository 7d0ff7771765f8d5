// Score of the landmark extractor on a simulated drive, against what its sweeps really hit.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "eval/experiments/frontend/kind_tally.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::eval::experiments::frontend {

/// Which sweeps are scored, and which landmarks must be found in them.
struct ExtractionOptions {
  int sweeps = 20;
  std::uint64_t first_revolution = 0;
  std::uint64_t stride = 10;              ///< Revolutions from one scored sweep to the next.
  double recall_range_m = 25.0;           ///< Landmarks farther away need not be found...
  std::uint32_t least_returns = 5;        ///< ... nor trunks with fewer returns than this...
  std::uint32_t least_side_returns = 10;  ///< ... nor corners with fewer on either wall within 2 m.
  double error_range_m = 20.0;            ///< Up to here errors of position are counted.
  double match_m = 0.5;                   ///< A detection farther from every true one is false.
  double attitude_sigma_rad = 0.003;      ///< Error of roll and of pitch that the sweep comes with.
  std::uint64_t seed = 1;
};

/// What the extractor found on a drive.
struct ExtractionScore {
  int beams = 0;
  std::uint64_t sweeps = 0;
  double points = 0.0;  ///< Mean per sweep.
  KindScore trunks;     ///< And poles.
  KindScore corners;
  /// Processor time per sweep.
  double time_p50_ms = 0.0;
  double time_p99_ms = 0.0;
  std::vector<ExtractionMiss> misses;
};

/// LIDAR_SWEEP as a perfect input would make it: de-skewed with the true motion to the time of the
/// revolution's last point; the attitude is off by `attitude_error_rad` (roll, pitch), with
/// covariance.
model::PointSweep ideal_input(const sim::SimulatedSweep& sweep, const sim::SensorDrive& drive,
                              const Eigen::Vector2d& attitude_error_rad, double attitude_sigma_rad);

/// Runs the extractor over a drive that has a spinning lidar. `progress` is called per sweep.
ExtractionScore score_extraction(sim::SensorDrive& drive,
                                 const landmark_extractor::LandmarkExtractorParameters& parameters,
                                 const ExtractionOptions& options,
                                 const std::function<void(int)>& progress = {});

}  // namespace understory::eval::experiments::frontend
