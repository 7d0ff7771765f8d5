// What localising one observation in a map of identical landmarks takes and gives.
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

/// What localising assumes of sensor and map, and when it accepts a pose. Sigmas are standard
/// deviations.
struct LocaliseParameters {
  /// Triangles of the observation are taken among so many nearest neighbours; in (1, 8].
  int neighbours = 5;
  /// What the map's landmarks leave uncertain, per axis; also a floor for optimistic sigmas [m].
  double map_sigma_m = 0.03;
  /// Sides of matching triangles differ by at most so many standard deviations: first the narrow
  /// search, which is quick and as a rule enough, then the wide one.
  double narrow_side_sigmas = 1.3;
  double wide_side_sigmas = 3.0;
  /// An observed point belongs to the nearest landmark within so many standard deviations...
  double gate_sigmas = 3.5;
  /// ... and never further away than this [m].
  double max_gate_m = 1.5;
  /// Share of the observed points that is expected in the map when the pose is right; the
  /// sequential test weighs hits and misses by it. Right poses with a lower share are found too.
  double expected_hit_ratio = 0.5;
  /// Accepted only if chance gives so good a pose less often than this, in all hypotheses tried.
  double max_log10_false_alarm = -6.0;
  /// ... and if the best different pose is so many decades more likely to be chance.
  double min_log10_margin = 6.0;
  /// Triangles of the accepted pose that are looked up again for the runner-up.
  int runner_up_probes = 3;
  /// Gives up ("not sure") after so many look-ups of a point in the map: what a search costs, for
  /// hypotheses that fail at once as for fits on all points.
  std::uint32_t max_lookups = 600000;
};

/// Why a search ended as it did. Everything but kFound means "no pose".
enum class LocaliseOutcome : std::uint8_t {
  kFound = 0,
  kTooFewPoints = 1,  ///< Fewer than three usable points, in the observation or in the map.
  kNoMatch = 2,       ///< No hypothesis held.
  kLikelyChance = 3,  ///< The best pose has too few hits to rule out chance.
  kAmbiguous = 4,     ///< A different pose fits nearly as well.
  kGaveUp = 5,        ///< max_lookups spent.
};
/// One line for a person, e.g. "too few points".
std::string_view describe(LocaliseOutcome outcome);

/// An observed point and the landmark that the final pose gives it.
struct PointAssociation {
  std::uint32_t observed = 0;  ///< Index in the observation.
  LandmarkId landmark_id = 0;
  double distance_m = 0.0;  ///< What the final pose leaves between the two.
};

/// The result of ConstellationMap::localise().
struct Localisation {
  LocaliseOutcome outcome = LocaliseOutcome::kNoMatch;
  /// Pose, covariance and associations are of the best hypothesis, also where it was not accepted
  /// (but empty where none held).
  geometry::SE2 map_T_sensor;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Tangent order, right perturbation.
  std::vector<PointAssociation> associations;            ///< One to one, by observed index.
  std::uint32_t inliers = 0;                             ///< Associations of the pose.
  std::uint32_t hypotheses = 0;                          ///< Poses tried.
  std::uint32_t lookups = 0;                             ///< Points looked up, the work done.
  /// log10 of an upper bound on the expected number of such good poses by chance.
  double log10_false_alarm = 0.0;
  /// Inliers of the best pose that is another one; 0 if none was found.
  std::uint32_t runner_up_inliers = 0;
  /// Decades between the false-alarm bounds of the two.
  double log10_margin = 0.0;

  /// True if the pose was accepted.
  bool found() const { return outcome == LocaliseOutcome::kFound; }
};

}  // namespace understory::constellation
