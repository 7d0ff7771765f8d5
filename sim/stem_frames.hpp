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

/// What a detector of stems misses and gets wrong. Sigmas are standard deviations.
struct StemDetectorParameters {
  double range_m = 25.0;
  double least_diameter_m = 0.08;  ///< Thinner stems are never detected.
  /// Of the stems, a new draw for each visit: what one visit detects at all. Two visits share so
  /// many of the stems of either.
  double seen_share = 0.64;
  double detection = 0.9;                    ///< Of those in each frame, where nothing hides them.
  double false_per_frame = 1.0;              ///< Mean number of stems that are none.
  double position_sigma_m = 0.03;            ///< Per axis, of a frame: independent.
  double diameter_sigma_share = 0.1;         ///< Of a diameter, of a frame.
  double tilt_sigma_rad = 0.05;              ///< Roll and pitch of the sensor.
  double view_rad = 2.0 * std::numbers::pi;  ///< Width of the field of view, its middle ahead.
  SharedErrorParameters shared;              ///< Errors of true stems on top, which frames share.
};

/// How it is driven.
struct StemDriveParameters {
  StemDetectorParameters detector;
  double spacing_m = 2.0;  ///< Between frames.
  double speed_mps = 1.0;
  double visit_gap_s = 60.0;  ///< A stem that was out of range for so long is visited anew.
  /// Two drives with one seed and other visits are drives on other days: other stems are detected,
  /// the way lies up to a metre beside.
  std::uint64_t visit = 0;
  double truth_offset_m = 0.0;  ///< Of the drive's truth, in x and in y: references disagree.
  /// The forest is thinned until the way has so many stems in view on average, those that other
  /// stems hide or the detector misses included; 0 = as it is. Visits share what is left.
  double stems_in_view = 0.0;
};

/// How a way through a forest is laid out.
enum class StemWay {
  kLaps,          ///< Round a closed way of random corners, and again and again.
  kThereAndBack,  ///< A random way, and back on it.
  kWander,        ///< Through random points, crossing itself.
};
/// By name, e.g. "there-and-back"; none for another.
std::optional<StemWay> stem_way(std::string_view name);
/// All names that stem_way() takes.
std::vector<std::string> stem_way_names();

/// A way of about `length_m` [m] inside the forest, 8 m from its edges; laps and the way back lie
/// about a metre beside each other. The same seed gives the same way. Throws std::runtime_error
/// where the forest is less than 50 m wide.
Route make_stem_way(StemWay kind, const Forest& forest, double length_m, std::uint64_t seed);

/// A recorded way, turned nowhere but shrunk where it does not fit, in the middle of the forest,
/// 8 m from its edges. Throws std::runtime_error where it has less than two places.
Route fit_stem_way(std::span<const Eigen::Vector2d> recorded_m, const Forest& forest);

/// The frames of a drive on the way: stems in range, nearer trunks hide those behind, in random
/// order; of the shared errors, the part by direction follows from the seed alone and returns at
/// other visits; diameters that the forest does not have are drawn. Position and axis of a stem
/// are 1.3 m above level ground, frame `sensor`, which is 1.5 m above it. The same arguments give
/// the same frames.
std::vector<model::StemFrame> drive_stem_frames(const Forest& forest, const Route& way,
                                                const StemDriveParameters& parameters,
                                                std::uint64_t seed);

}  // namespace understory::sim
