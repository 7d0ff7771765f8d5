// Finds the landmarks in one sweep.
#pragma once

#include <cstdint>

#include "common/model/landmarks.hpp"
#include "common/model/planar_scan.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/scan_corners.hpp"
#include "services/landmark_extractor/sweep_extractor.hpp"

namespace understory::landmark_extractor {

/// Counts of the objects in planar scans since the start, for HEALTH.
struct ExtractorCounters {
  std::uint64_t scans = 0;
  std::uint64_t scans_malformed = 0;  ///< No beams, or impossible angles.
  std::uint64_t objects = 0;          ///< Segments of scans.
  std::uint64_t too_few_points = 0;   ///< Fewer than `min_points` beams.
  std::uint64_t not_alone = 0;        ///< Another object beside it at about the same distance.
  std::uint64_t out_of_range = 0;     ///< Outside the range limits of landmarks.
  std::uint64_t not_round = 0;        ///< No circle fits, or one of the wrong size.
  std::uint64_t landmarks = 0;        ///< Trunks.
};

/// The stage, for both kinds of laser. It has no state: each sweep is processed independently, and
/// counters restart with the process.
class LandmarkExtractor {
 public:
  /// Parameters of both kinds.
  explicit LandmarkExtractor(const LandmarkExtractorParameters& parameters = {})
      : parameters_(parameters),
        corners_(parameters.planar, parameters.planar_corner),
        sweeps_(parameters) {}

  /// Landmarks of a one-plane laser, in frame vehicle. Trunks: isolated round objects of a trunk's
  /// size, in order of bearing. Then corners. A malformed scan gives none.
  model::LandmarkScan extract(const model::PlanarScan& scan);
  /// Likewise of a 3-D laser, see SweepExtractor, or of a de-skewed scan in one plane (one ring),
  /// in `vehicle_level`.
  model::LandmarkScan extract(const model::PointSweep& sweep);
  /// Range of view at the height of trunks (of one plane: in it), of the last sweep or scan; no
  /// bins if it was malformed.
  const model::ViewRanges& view() const { return view_; }
  /// Counts of planar scans.
  const ExtractorCounters& counters() const { return counters_; }
  /// Of sweeps in space.
  const SweepCounters& sweep_counters() const { return sweeps_.counters(); }

 private:
  /// Uncertainty of a plane's attitude and of heights.
  struct PlaneLevel {
    double landmark_z_m = 0.0;
    Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();  ///< Of (roll, pitch).
  };
  void find(const planar::Beams& scan, const PlaneLevel& level, model::LandmarkScan& result);

  LandmarkExtractorParameters parameters_;
  ExtractorCounters counters_;
  points::SpinFitter spin_fitter_;
  planar::ScanCorners corners_;
  SweepExtractor sweeps_;
  model::ViewRanges view_;
};

}  // namespace understory::landmark_extractor
