// Finds the landmarks in one sweep.
#pragma once

#include <cstdint>

#include "common/model/landmarks.hpp"
#include "common/model/planar_scan.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/planar/scan_corners.hpp"
#include "services/landmark_extractor/sweep_extractor.hpp"

namespace understory::landmark_extractor {

/// What became of the objects in planar scans since the start, for HEALTH.
struct ExtractorCounters {
  std::uint64_t scans = 0;
  std::uint64_t scans_malformed = 0;  ///< No beams, or impossible angles.
  std::uint64_t objects = 0;          ///< Segments of scans.
  std::uint64_t too_few_points = 0;   ///< Less than `min_points` beams.
  std::uint64_t not_alone = 0;        ///< Something beside it at about the same distance.
  std::uint64_t out_of_range = 0;     ///< Nearer or farther than landmarks are reported.
  std::uint64_t not_round = 0;        ///< No circle fits, or one of the wrong size.
  std::uint64_t landmarks = 0;        ///< Trunks.
};

/// The stage, for both kinds of laser. It has no state: each sweep is judged by itself, and
/// counters begin anew after a restart.
class LandmarkExtractor {
 public:
  /// Parameters of both kinds.
  explicit LandmarkExtractor(const LandmarkExtractorParameters& parameters = {})
      : parameters_(parameters),
        corners_(parameters.planar, parameters.planar_corner),
        sweeps_(parameters) {}

  /// Landmarks of a one-plane laser, in frame vehicle. Trunks: objects that stand alone, are round,
  /// and have a trunk's size, in order of bearing. Then corners. A malformed scan gives none.
  model::LandmarkScan extract(const model::PlanarScan& scan);
  /// The same of a laser that scans in space, see SweepExtractor, or of a de-skewed scan in one
  /// plane (one ring), in `vehicle_level`.
  model::LandmarkScan extract(const model::PointSweep& sweep);
  /// How far one can see at the height of trunks (of one plane: in it): of the last sweep or scan
  /// that was extracted; no bins where that was malformed.
  const model::ViewRanges& view() const { return view_; }
  /// Of planar scans.
  const ExtractorCounters& counters() const { return counters_; }
  /// Walls and corners of planar scans.
  const corners::CornerCounters& planar_corner_counters() const { return corners_.counters(); }
  /// Of sweeps in space.
  const SweepCounters& sweep_counters() const { return sweeps_.counters(); }

 private:
  /// What is known of a plane's attitude and of heights.
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
