// Connects the associator to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::associator {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct AssociatorChannels {
  bus::ChannelList all;
  std::string landmarks = all.in("LANDMARKS", "detections of one sweep");
  std::string odometry = all.in("ODOMETRY", "motion without landmarks, if available");
  std::string filter_pose = all.in("EKF_POSE", "pose of the filter, one sweep behind");
  std::string tracked_landmarks =
      all.out("TRACKED_LANDMARKS", "the consistent detections, with track ids");
};

/// The service: its name, its channels and the factory of its adapter. The stage is made when the
/// service is bound, with the parameters of that time.
bus::Service associator_service(const AssociatorChannels& channels = {});

}  // namespace understory::associator
