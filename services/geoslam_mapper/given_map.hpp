// A given map: read from a file or received as a message.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/geometry/se2.hpp"
#include "common/model/archive.hpp"
#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// One map of a map file, its landmarks in order of id. `map_id` 0: the only map in the file that
/// has landmarks. Throws map_file::MapFileError, or std::runtime_error with the name of the file if
/// that map is missing or has no landmark.
model::WholeMap read_given_map(const std::string& file, int map_id);

/// Reason why the mapper cannot start with this map; empty if it can: the map is whole, has
/// landmarks, and they are finite and in order of id.
std::string why_not_given(const model::WholeMap& map);

/// The map's landmarks with their covariance relative to the nearest keyframe, at least
/// `least_sigma_m`. A driven map states covariances relative to its first keyframe; far from there
/// they are large, and neighbours share nearly all of the error. Treated as independent errors they
/// would make the association of detections ambiguous. Unchanged: landmarks of a map without
/// keyframes (a survey), and those with a stated sigma below `least_sigma_m`. Keyframes with
/// invalid values are skipped. Cost: one search for the nearest keyframe per landmark.
std::vector<model::MapLandmark> apart_from_keyframes(const model::WholeMap& map,
                                                     double least_sigma_m);

/// Uncertainty of a given map in its own frame. apart_from_keyframes() removes it from the
/// landmarks; poses that are localised in the map must include it. Unobserved errors of the drive
/// bend the map as a whole, and no later observation in the map reveals them.
class GivenFrame {
 public:
  /// Zero uncertainty: no map was given, or one without keyframes (a survey).
  GivenFrame() = default;
  /// Frame of this map. Keyframes with invalid values are skipped; of keyframes within kApart_m
  /// (5 m) of each other one is kept.
  explicit GivenFrame(const model::WholeMap& map);

  /// Number of the map; 0 if none was given.
  std::uint32_t map_id() const { return map_id_; }
  /// Covariance in the map's frame of a pose that is known exactly relative to the map around it
  /// (right perturbation): the nearest keyframe's covariance, transported to the pose. O(keyframes
  /// around it).
  Eigen::Matrix3d covariance_at(const geometry::SE2& map_T_vehicle) const;

  /// Members of a saved state; see common/state. After a load call rebuild().
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.map_id_, self.keyframes_);
  }
  /// Indexes the keyframes anew.
  void rebuild();

 private:
  friend std::vector<model::MapLandmark> apart_from_keyframes(const model::WholeMap&, double);
  static constexpr double kCell_m = 10.0;

  /// A keyframe whose covariance is known.
  struct Known {
    geometry::SE2 map_T_vehicle;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.map_T_vehicle, s.covariance);
    }
  };
  const Known* nearest_to(const Eigen::Vector2d& at_m) const;

  std::uint32_t map_id_ = 0;
  std::vector<Known> keyframes_;
  constellation::PointGrid grid_{kCell_m};  ///< Grid of the keyframes.
};

}  // namespace understory::geoslam_mapper
