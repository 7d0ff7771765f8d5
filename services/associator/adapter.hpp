// The associator on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::associator {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct AssociatorChannels {
  bus::ChannelList all;
  std::string landmarks = all.in("LANDMARKS", "detections of one sweep");
  std::string odometry = all.in("ODOMETRY", "motion without landmarks, where there is any");
  std::string filter_pose = all.in("EKF_POSE", "pose of the filter, one sweep behind");
  std::string tracked_landmarks =
      all.out("TRACKED_LANDMARKS", "the consistent detections, with track ids");
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service associator_service(const AssociatorChannels& channels = {});

}  // namespace understory::associator
