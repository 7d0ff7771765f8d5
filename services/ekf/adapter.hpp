// The filter on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::ekf {

/// Names of the channels; README.md lists their messages.
struct EkfChannels {
  std::string odometry = "ODOMETRY";
  std::string tracked_landmarks = "TRACKED_LANDMARKS";
  std::string raw_pose = "RAW_POSE";
  std::string pose = "EKF_POSE";
  std::string map = "EKF_MAP";
  std::string level = "EKF_LEVEL";
  std::string velocity_correction = "VELOCITY_CORRECTION";
};

/// The filter as a service: decodes, calls Ekf, publishes. Its state is saved and loaded by the
/// runtime.
bus::Service ekf_service(const EkfChannels& channels = {});

}  // namespace understory::ekf
