// Input and result of localising one observation in a map of identical landmarks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::constellation {

/// Permanent name of a landmark (the same type as the map's of common/model).
using LandmarkId = std::uint64_t;

/// A landmark as observed, frame `sensor`.
struct ObservedPoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double sigma_m = 0.0;  ///< Standard deviation per axis.
};

/// A disc in the map, e.g. where a prior puts the sensor. Frame `map`.
struct Disc {
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
};

/// Assumptions on sensor and map, and the limits for accepting a pose. Sigmas are standard
/// deviations.
struct LocaliseParameters {
  /// Triangles of the observation are formed among this many nearest neighbours; in (1, 8].
  int neighbours = 5;
  /// Standard deviation of the map's landmarks per axis; also the least sigma of an observed point
  /// [m].
  double map_sigma_m = 0.03;
  /// Largest difference between sides of matching triangles, in standard deviations: first the
  /// narrow search, which is quick and usually sufficient, then the wide one.
  double narrow_side_sigmas = 1.3;
  double wide_side_sigmas = 3.0;
  /// An observed point belongs to the nearest landmark within this many standard deviations...
  double gate_sigmas = 3.5;
  /// ... and within this distance [m].
  double max_gate_m = 1.5;
  /// Share of the observed points that the map is expected to contain; the sequential test weights
  /// hits and misses by it. Right poses with a lower share are found too.
  double expected_hit_ratio = 0.5;
  /// A pose is accepted only if the expected number of equally good poses by chance, over all
  /// hypotheses tried, is below this ...
  double max_log10_false_alarm = -6.0;
  /// ... and if this expected number is larger by this many decades for the best different pose.
  double min_log10_margin = 6.0;
  /// Triangles of the accepted pose that are looked up again to find the runner-up.
  int runner_up_probes = 3;
  /// The search gives up after this many look-ups of a point in the map. Look-ups measure the cost
  /// of quickly rejected hypotheses and of fits on all points alike.
  std::uint32_t max_lookups = 600000;
};

/// How a search ended. Everything but kFound means "no pose".
enum class LocaliseOutcome : std::uint8_t {
  kFound = 0,
  kTooFewPoints = 1,  ///< Fewer than three usable points, in the observation or in the map.
  kNoMatch = 2,       ///< No hypothesis passed its test.
  kLikelyChance = 3,  ///< The best pose has too few hits to rule out chance.
  kAmbiguous = 4,     ///< A different pose fits nearly as well.
  kGaveUp = 5,        ///< max_lookups spent.
};
/// One line of text, e.g. "too few points".
std::string_view describe(LocaliseOutcome outcome);

/// An observed point and the landmark paired with it at the final pose.
struct PointAssociation {
  std::uint32_t observed = 0;  ///< Index in the observation.
  LandmarkId landmark_id = 0;
  double distance_m = 0.0;  ///< Distance between the two at the final pose.
};

/// The result of ConstellationMap::localise().
struct Localisation {
  LocaliseOutcome outcome = LocaliseOutcome::kNoMatch;
  /// Pose, covariance and associations belong to the best hypothesis, also where it was not
  /// accepted; empty where no hypothesis passed.
  geometry::SE2 map_T_sensor;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  std::vector<PointAssociation> associations;            ///< One to one, by observed index.
  std::uint32_t inliers = 0;                             ///< Number of associations.
  std::uint32_t hypotheses = 0;                          ///< Poses tried.
  std::uint32_t lookups = 0;  ///< Look-ups of points in the map (the cost).
  /// log10 of an upper bound on the expected number of equally good poses by chance.
  double log10_false_alarm = 0.0;
  /// Inliers of the best different pose; 0 if none was found.
  std::uint32_t runner_up_inliers = 0;
  /// Decades between the false-alarm bounds of the best and the runner-up.
  double log10_margin = 0.0;

  /// True if the pose was accepted.
  bool found() const { return outcome == LocaliseOutcome::kFound; }
};

}  // namespace understory::constellation
