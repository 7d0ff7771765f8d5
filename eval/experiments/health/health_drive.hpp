// A drive through landmarks with a fault in it, and what HEALTH said of it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sim/inertial_drive.hpp"

namespace understory::eval::experiments::health {

/// Changes what a scan's interval brings, from the time on at which the fault begins.
using Meddle = std::function<void(sim::DriveStep& step, std::mt19937_64& random)>;

/// One kind of fault.
struct Fault {
  std::string name;
  Meddle meddle;           ///< Empty = none.
  double skipped_s = 0.0;  ///< The vehicle is carried away: so much of the drive is cut out.
};
/// Scans that are so much older than their stamps [s]: what they show is still further ahead, and
/// not yet turned.
Meddle late_by(double seconds);
/// Those of the experiment; the first one is no fault.
std::vector<Fault> faults();

/// How long a drive is, and where its fault is.
struct DrivePlan {
  double seconds = 60.0;
  double fault_at_s = 25.0;
  double fault_lasts_s = 20.0;  ///< Then all is as before.
};

/// Errors of one channel over a drive.
struct PoseErrors {
  int poses = 0;
  int wrong = 0;           ///< More than 1 m off after one rigid alignment of the whole path.
  double ate_m = 0.0;      ///< Root mean square of the position's error after it.
  double mean_nees = 0.0;  ///< Of the pose with the first one held; 3 is exact.
};

/// What one drive showed. An error is noticeable once the pose has left its 99.9 % ellipse for over
/// 1 s, or is more than 1 m off for 2 s; it is noticed if any stage's state is not OK within 10 s.
struct DriveVerdict {
  int scans = 0;
  int scans_not_ok = 0;  ///< With the state of any stage not OK.
  int errors = 0;        ///< Noticeable ones: the first of SLAM_POSE and of EKF_POSE.
  int errors_unnoticed = 0;
  double largest_error_m = 0.0;
  PoseErrors slam;
  PoseErrors filter;
  std::map<std::string, int> reasons;  ///< "stage reason": how often it began.
};

/// Drives once: keyframer, associator, filter and mapper with their own defaults, odometry in use.
DriveVerdict drive(const Fault& fault, const DrivePlan& plan, std::uint64_t seed);

}  // namespace understory::eval::experiments::health
