// One world, mapped once with a camera, changed, and driven through again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "eval/experiments/existence/camera/keypoint_map.hpp"
#include "eval/experiments/existence/looks.hpp"
#include "sim/changes/course.hpp"

namespace understory::eval::experiments::existence::camera {

/// What is driven.
struct CaseSetting {
  sim::changes::SceneKind scene = sim::changes::SceneKind::kOffice;
  bool has_bare_walls = false;  ///< A tenth of the texture on walls and ceilings.
  /// Nothing is gone or new but carts or lorries beside the path, which hide what stays.
  bool has_occluders_alone = false;
  double changed = 0.2;       ///< Share of the things that can change; 0: nothing differs.
  int changed_drives = 3;     ///< Before the one that is held out.
  double frames_per_s = 4.0;  ///< Of mapping, updates and tracking.
  double gap_days = 30.0;     ///< From the mapping drive to the others.
  int frames_per_query = 4;   ///< Of the drive held out every so many are relocalised.
  double forest_circle_m = 80.0;
  double forest_margin_m = 30.0;
};

/// "office", "office, bare walls".
std::string name_of_world(const CaseSetting& setting);

/// What a drive says of keypoints that are no point of the map.
struct DriveKeypoints {
  std::size_t all = 0;
  std::size_t without_point = 0;
};

/// The map, what was seen of it, and the drive that is held out.
struct CameraCase {
  sim::changes::CameraParameters camera;
  std::vector<CameraPoint> map;
  History history;  ///< Drive 0 maps, then the changed ones; looks carry rays from disparities.
  std::vector<DriveKeypoints> keypoints;  ///< By drive.
  std::vector<sim::changes::CameraFrame> held_out;
};

/// The same for the same arguments. A case that shall tune alone needs no drive held out.
CameraCase make_case(const CaseSetting& setting, std::uint64_t seed, bool has_held_out = true);

/// The same looks without rays.
History without_rays(History history);

}  // namespace understory::eval::experiments::existence::camera
