// Drives as frames of detected stems through surveyed forests, for place recognition.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/stem_frame.hpp"
#include "sim/forest.hpp"
#include "sim/route.hpp"
#include "sim/shared_errors.hpp"

namespace understory::sim {

/// Misses and errors of a stem detector. Sigmas are standard deviations.
struct StemDetectorParameters {
  double range_m = 25.0;
  double least_diameter_m = 0.08;  ///< Thinner stems are never detected.
  /// Share of the stems that one visit detects at all, drawn anew for each visit. Two visits have
  /// this share of each one's stems in common.
  double seen_share = 0.64;
  double detection = 0.9;                    ///< Of those in each frame, unless occluded.
  double false_per_frame = 1.0;              ///< Mean number of false detections.
  double position_sigma_m = 0.03;            ///< Per axis, per frame: independent.
  double diameter_sigma_share = 0.1;         ///< Of a diameter, per frame.
  double tilt_sigma_rad = 0.05;              ///< Roll and pitch of the sensor.
  double view_rad = 2.0 * std::numbers::pi;  ///< Width of the field of view, centred ahead.
  SharedErrorParameters shared;  ///< Additional errors of true stems, common to several frames.
};

/// Parameters of the drive.
struct StemDriveParameters {
  StemDetectorParameters detector;
  double spacing_m = 2.0;  ///< Between frames.
  double speed_mps = 1.0;
  double visit_gap_s = 60.0;  ///< A stem that was out of range for this time is visited anew.
  /// Two drives with one seed and different visits are drives on different days: other stems are
  /// detected, and the path is up to a metre beside.
  std::uint64_t visit = 0;
  double truth_offset_m =
      0.0;  ///< Of the drive's truth, in x and in y: offset between reference systems.
  /// The forest is thinned until this number of stems is in view of the path on average, including
  /// occluded and missed ones; 0 = not thinned. All visits use the same thinned forest.
  double stems_in_view = 0.0;
};

/// Kinds of paths through a forest.
enum class StemWay {
  kLaps,          ///< Laps on a closed path with random corners.
  kThereAndBack,  ///< A random path, and back on it.
  kWander,        ///< Through random points, crossing itself.
};
/// By name, e.g. "there-and-back"; none for another.
std::optional<StemWay> stem_way(std::string_view name);
/// All names accepted by stem_way().
std::vector<std::string> stem_way_names();

/// A path of about `length_m` [m] inside the forest, 8 m from its edges; laps and the way back are
/// about a metre apart. The same seed gives the same path. Throws std::runtime_error if the forest
/// is less than 50 m wide.
Route make_stem_way(StemWay kind, const Forest& forest, double length_m, std::uint64_t seed);

/// A recorded path, not rotated but shrunk if it does not fit, in the middle of the forest, 8 m
/// from its edges. Throws std::runtime_error if it has less than two points.
Route fit_stem_way(std::span<const Eigen::Vector2d> recorded_m, const Forest& forest);

/// The frames of a drive on the path: stems in range, in random order; nearer trunks hide those
/// behind; of the shared errors, the part by direction follows from the seed alone and repeats at
/// other visits; diameters that the forest lacks are drawn. Position and axis of a stem are 1.3 m
/// above level ground, frame `sensor`, which is 1.5 m above it. The same arguments give the same
/// frames.
std::vector<model::StemFrame> drive_stem_frames(const Forest& forest, const Route& way,
                                                const StemDriveParameters& parameters,
                                                std::uint64_t seed);

}  // namespace understory::sim
