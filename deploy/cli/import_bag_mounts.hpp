// Where the sensors of a bag sit, as settings of lidar_imu_input.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bag/survey.hpp"
#include "deploy/cli/import_bag_choice.hpp"

namespace understory::cli {

/// Frames of a bag on the vehicle.
class BagMounts {
 public:
  /// `base`: the frame that is `vehicle`; empty = base_link, else base_footprint, where there is
  /// one. `stated`: "FRAME=x,y,z[,roll,pitch,yaw]" [m, rad]. Throws io::DataError where these are
  /// no numbers.
  BagMounts(bag::StaticTransforms transforms, const std::string& base,
            const std::vector<std::string>& stated);

  /// Throws io::DataError where a frame that was stated is none of the bag's.
  void require_known(const bag::Survey& survey) const;
  /// vehicle_T_frame; none = stated by neither the bag nor an option.
  std::optional<Eigen::Isometry3d> find(const std::string& frame) const;
  const std::string& base() const { return base_; }  ///< The frame `vehicle` in the bag.
  /// Why the frame's mount is not known, with the option that states it.
  std::string missing(const std::string& frame) const;

 private:
  bag::StaticTransforms transforms_;
  std::string base_;
  std::map<std::string, Eigen::Isometry3d> stated_;
};

/// What the import found and used.
struct BagFindings {
  bool has_times = true;     ///< The cloud's points have times.
  bool has_rings = true;     ///< The cloud's points have rings.
  double wheelbase_m = 2.7;  ///< With which RAW_WHEELS has steering.
};

/// What lidar_imu_input must know of the bag, as TOML; missing mounts are comments that say so.
/// `remarks` gets a line for each.
std::string bag_settings(const bag::Bag& bag, const bag::Survey& survey, const BagChoice& choice,
                         const BagMounts& mounts, const BagFindings& findings,
                         std::vector<std::string>& remarks);
/// Writes a folder for `replay --config`: launch.toml on top of the built-in lidar configuration,
/// and the settings. Throws std::runtime_error where it cannot be written.
void write_bag_config(const std::string& folder, const std::string& settings);

}  // namespace understory::cli
