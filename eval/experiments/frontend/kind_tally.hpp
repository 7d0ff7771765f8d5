// Detections of one kind of landmark against the true ones: precision, recall, errors, consistency.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::eval::experiments::frontend {

/// One kind of landmark, over all sweeps.
struct KindScore {
  std::uint64_t should = 0;  ///< True landmarks that had to be found.
  std::uint64_t found = 0;   ///< Of those.
  std::uint64_t detections = 0;
  std::uint64_t right = 0;       ///< Detections of a true landmark, the first for each.
  double rms_m = 0.0;            ///< In the plan, within the range for errors.
  double bias_along_m = 0.0;     ///< Mean error along the ray, away from the vehicle, and to its
  double bias_across_m = 0.0;    ///< left; within the same range. It does not average out.
  double nees_plan = 0.0;        ///< Mean, all matched; 2 is exact.
  double nees_space = 0.0;       ///< With the height; 3 is exact.
  double bearing_rms_rad = 0.0;  ///< Corners: of the bisector.
  double nees_bearing = 0.0;     ///< Corners; 1 is exact.

  /// Share of the detections that are right; 1 where there are none.
  double precision() const {
    return detections > 0 ? static_cast<double>(right) / detections : 1.0;
  }
  /// Share of the landmarks that had to be found; 1 where there are none.
  double recall() const { return should > 0 ? static_cast<double>(found) / should : 1.0; }
};

/// A false detection, or a landmark that was not found: for inspection.
struct ExtractionMiss {
  model::Utime utime = 0;
  bool is_false = false;       ///< Else not found.
  model::Detection detection;  ///< Of a landmark not found: its true place.
  std::uint32_t returns = 0;
};

/// A true landmark, 1.3 m above the ground; frame `vehicle_level` of the scan.
struct TrueLandmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::optional<double> bisector_rad;
  std::uint32_t returns = 0;
  bool should = false;  ///< Must be found.
  bool is_taken = false;
};

/// Sums of one kind over the scans until the means are taken.
class KindTally {
 public:
  /// `match_m`: a detection farther from every true one is false. `error_range_m`: up to here
  /// errors of position are counted.
  KindTally(double match_m, double error_range_m)
      : match_m_(match_m), error_range_m_(error_range_m) {}

  /// Each detection takes the nearest true landmark that is free; nearest pairs of a sweep would
  /// differ only where two trunks are within half a metre.
  void add(const model::LandmarkScan& scan, model::LandmarkKind kind,
           std::vector<TrueLandmark> truths, std::vector<ExtractionMiss>& misses);
  /// Over all scans so far.
  KindScore score() const;

 private:
  void match(const model::Detection& detection, const TrueLandmark& truth);

  double match_m_;
  double error_range_m_;
  KindScore sums_;
  double square_m2_ = 0.0;
  double square_rad2_ = 0.0;
  std::uint64_t near_ = 0;
};

}  // namespace understory::eval::experiments::frontend
