// The invariants of a drive with faults: poses against the truth, and what HEALTH said meanwhile.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/slam_output.hpp"
#include "eval/experiments/reliability/fault.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "understory/health_t.hpp"

namespace understory::eval::experiments::reliability {

/// A pose as a process said it, with what the system said of itself when it came.
struct SaidPose {
  model::Utime utime = 0;
  double received_s = 0.0;  ///< Of the drive, as played.
  geometry::SE2 frame_T_vehicle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint32_t frame = 0;
  std::uint64_t resets = 0;
  bool is_ok = true;  ///< HEALTH of every process said OK.
};

/// A pose as it was published, received at its own time; none of a SLAM_POSE that says that it has
/// no place.
std::optional<SaidPose> said_pose(const model::SlamPose& pose);
SaidPose said_pose(const model::EkfPose& pose);

/// What became of one pose channel after one fault: from its end to the beginning of the next one.
struct AfterFault {
  std::size_t poses = 0;
  std::size_t within_3_sigma = 0;
  double largest_step_m = 0.0;  ///< Change of the error since the last pose before the fault.
  double largest_sigmas = 0.0;  ///< Square root of the largest NEES.
  double largest_unannounced_m = 0.0;  ///< Step while HEALTH is OK and there was no reset.
  double ok_while_far_s = 0.0;         ///< Longest stretch over 1 m off with HEALTH OK.
  bool goes_on = false;                ///< A pose from 2 s after the fault's end on.
  bool is_announced = false;           ///< A reset or a new map.
};

/// What no pose may be, at any time.
struct Broken {
  std::size_t not_finite = 0;
  std::size_t not_positive_definite = 0;
  std::size_t not_later = 0;  ///< A stamp not behind the one before.
};

/// Counts what is broken in a channel's poses, in the order in which they came.
Broken broken(std::span<const SaidPose> poses);

/// Each frame is tied to the truth by its first pose. Entry i: after fault i, by stamps of poses.
/// The gap itself (until its end and 0.2 s more) is left out.
std::vector<AfterFault> judge(std::span<const SaidPose> poses,
                              std::span<const metrics::StampedPose> truth,
                              std::span<const Fault> faults);

/// HEALTH of all processes, as it comes.
class HealthState {
 public:
  /// The latest of one process.
  void add(const health_t& health) { states_[health.process] = health; }
  /// Whether every process that was heard said OK.
  bool is_ok() const;
  /// "process: reason, reason" of those that did not.
  std::string text() const;
  /// Process number; 0 = not heard.
  std::int64_t pid(const std::string& process) const;
  /// Messages that were lost or dropped, of all channels of all processes.
  std::uint64_t lost() const;

 private:
  std::map<std::string, health_t> states_;
};

}  // namespace understory::eval::experiments::reliability
