// The keyframer on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::keyframer {

/// Names of the channels that the process reads and writes.
struct KeyframerChannels {
  std::string landmarks = "LANDMARKS";
  std::string odometry = "ODOMETRY";
  std::string ekf_level = "EKF_LEVEL";
  std::string keyframe = "KEYFRAME";
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service keyframer_service(const KeyframerChannels& channels = {});

}  // namespace understory::keyframer
