// A map to begin with: from a file or from a message.
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

/// One map of a map file, its landmarks in order of id. `map_id` 0: the only one in the file
/// that has landmarks. Throws map_file::MapFileError, or std::runtime_error that names the file
/// where that map is not in it or has no landmark.
model::WholeMap read_given_map(const std::string& file, int map_id);

/// Why a message's map cannot be begun with; empty where it can: it is whole, has landmarks, and
/// all of them are finite and in order of id.
std::string why_not_given(const model::WholeMap& map);

/// The map's landmarks with the covariance that each has beside the keyframe nearest to it, at
/// least `least_sigma_m`. A map that was driven states covariances relative to its first keyframe;
/// far from there they are large, and nearly all of it neighbours share. Taken for an error of each
/// landmark it would hide which of them a detection is. Landmarks of a map without keyframes (a
/// survey), and those that are stated to be better than `least_sigma_m`, stay as they are.
/// Keyframes with values that cannot be are passed over. Cost: each landmark looks around it.
std::vector<model::MapLandmark> apart_from_keyframes(const model::WholeMap& map,
                                                     double least_sigma_m);

/// How well the places of a given map are known in its frame: what apart_from_keyframes() takes out
/// of the landmarks, and what poses that are found by them must state. A map that was driven is
/// bent as a whole by what its drive did not know; nothing that is seen in it later shows that.
class GivenFrame {
 public:
  /// Known to the last digit: no map was given, or one without keyframes (a survey).
  GivenFrame() = default;
  /// Of that map. Keyframes with values that cannot be are passed over; of those within some metres
  /// one is kept.
  explicit GivenFrame(const model::WholeMap& map);

  /// Number of the map; 0 where none was given.
  std::uint32_t map_id() const { return map_id_; }
  /// Covariance of a pose that is known exactly in the map around it (right perturbation): that of
  /// the nearest keyframe, carried to the pose. O(keyframes around it).
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
  constellation::PointGrid grid_{kCell_m};  ///< Of them.
};

}  // namespace understory::geoslam_mapper
