// The associator on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::associator {

/// Names of the channels that the process reads and writes.
struct AssociatorChannels {
  std::string landmarks = "LANDMARKS";
  std::string odometry = "ODOMETRY";
  std::string filter_pose = "EKF_POSE";
  std::string tracked_landmarks = "TRACKED_LANDMARKS";
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service associator_service(const AssociatorChannels& channels = {});

}  // namespace understory::associator
