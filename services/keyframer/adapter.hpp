// The keyframer's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::keyframer {

struct KeyframerChannels {
  std::string landmarks = "LANDMARKS";
  std::string odometry = "ODOMETRY";
  std::string ekf_pose = "EKF_POSE";
  std::string ekf_level = "EKF_LEVEL";
  std::string keyframe = "KEYFRAME";
};

bus::Service keyframer_service(const KeyframerChannels& channels = {});

}  // namespace understory::keyframer
