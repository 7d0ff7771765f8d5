// The filter's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::ekf {

struct EkfChannels {
  std::string odometry = "ODOMETRY";
  std::string tracked_landmarks = "TRACKED_LANDMARKS";
  std::string pose = "EKF_POSE";
  std::string map = "EKF_MAP";
  std::string level = "EKF_LEVEL";
  std::string velocity_correction = "VELOCITY_CORRECTION";
};

bus::Service ekf_service(const EkfChannels& channels = {});

}  // namespace understory::ekf
