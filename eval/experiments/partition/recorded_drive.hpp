// What a mapper is fed on a drive: made once, mapped as often as there are policies.
#pragma once

#include <filesystem>
#include <variant>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"
#include "eval/experiments/partition/route.hpp"
#include "eval/metrics/victoria_park_score.hpp"

namespace understory::eval::experiments::partition {

/// One message to the mapper.
using MapperInput = std::variant<model::Odometry, model::RestLevel, model::EkfPose, model::EkfLevel,
                                 model::Keyframe>;

/// The messages of a drive in their order, and the truth.
struct RecordedDrive {
  std::vector<MapperInput> inputs;
  std::vector<metrics::StampedPose> truth;  ///< Frame `world`, at the truth's own rate.

  /// Path of the vehicle in truth [m].
  double length_m() const;
  /// The same drive up to where the vehicle has driven `along_m`.
  RecordedDrive first(double along_m) const;
};

/// All keyframes and odometry of a route that has not been asked for any.
RecordedDrive record(Route& route);
/// Writes the drive as an LCM log (KEYFRAME, ODOMETRY, REST_LEVEL, EKF_POSE, EKF_LEVEL,
/// GROUND_TRUTH), whole or not at all. Throws io::LogError.
void save(const RecordedDrive& drive, const std::filesystem::path& log);
/// Reads such a log. Throws io::LogError, and std::runtime_error naming the file where a message is
/// damaged.
RecordedDrive load(const std::filesystem::path& log);

}  // namespace understory::eval::experiments::partition
