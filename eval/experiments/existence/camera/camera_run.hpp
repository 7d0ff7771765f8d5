// Methods on one case: what they remove, and what that is worth to a camera.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "eval/experiments/existence/camera/camera_case.hpp"
#include "eval/experiments/existence/protocol.hpp"

namespace understory::eval::experiments::existence::camera {

/// A method, and whether it is given the rays.
struct CameraMethod {
  TunedMethod tuned;
  bool has_rays = false;
  bool is_ablation = false;  ///< What it says of the points is scored, and no camera looks for it.
};

/// One frame that was looked for in a culled map.
struct Query {
  bool is_success = false;
  bool is_wrong = false;  ///< Accepted, and not within the limits.
  int samples = 0;        ///< Of RANSAC.
  double error_m = 0.0;   ///< Of a success.
};

/// What a method made of a case.
struct MethodOnCase {
  std::vector<ScoredPoint> scored;  ///< After the last drive: in clear view 10 times, 3 directions.
  std::vector<ScoredPoint> rest;
  std::vector<ScoredPoint> hidden;  ///< Of both: there, and in no clear view in the last drive.
  std::size_t map_points = 0;       ///< That are left.
  std::vector<Query> queries;       ///< The same frames for all methods.
  double ate_m = 0.0;               ///< RMS of the tracked places, in the map's frame.
  int lost = 0;                     ///< Tracked frames by odometry alone.
};

/// What a drive says of the map: does it have to be made anew?
struct MappingSignal {
  double missed_points = 0.0;      ///< Share of the points in use, looked for thrice, never seen.
  double keypoints_without = 0.0;  ///< Share of the keypoints that are no point of the map.
  double doubt = 0.0;              ///< Mean of 1 - P of the points in use that were looked for.

  double both() const { return missed_points + keypoints_without; }
};

/// All methods on one case, and the signal by changed drive.
struct CaseResult {
  CaseSetting setting;
  std::uint64_t seed = 0;
  std::size_t map_points = 0;
  std::size_t tracked_frames = 0;
  std::vector<MethodOnCase> methods;
  std::vector<MappingSignal> signals;
};

/// Makes the case, updates each method on its drives, then relocalises and tracks in the drive held
/// out. `signal_method` is the one whose P says which points are in use.
CaseResult run_case(const CaseSetting& setting, std::uint64_t seed,
                    const std::vector<CameraMethod>& methods, std::size_t signal_method);

}  // namespace understory::eval::experiments::existence::camera
