// The associator's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::associator {

struct AssociatorChannels {
  std::string landmarks = "LANDMARKS";
  std::string odometry = "ODOMETRY";
  std::string filter_pose = "EKF_POSE";
  std::string tracked_landmarks = "TRACKED_LANDMARKS";
};

bus::Service associator_service(const AssociatorChannels& channels = {});

}  // namespace understory::associator
