// Connects the keyframer to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::keyframer {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct KeyframerChannels {
  bus::ChannelList all;
  std::string landmarks = all.in("LANDMARKS", "detections of one sweep");
  std::string odometry = all.in("ODOMETRY", "motion without landmarks, if available");
  std::string ekf_level =
      all.in("EKF_LEVEL", "error of roll and pitch of the sweeps, if a filter runs");
  std::string keyframe = all.out("KEYFRAME", "local landmarks of n sweeps");
};

/// The service: its name, its channels and the factory of its adapter. The stage is made when the
/// service is bound, with the parameters of that time.
bus::Service keyframer_service(const KeyframerChannels& channels = {});

}  // namespace understory::keyframer
