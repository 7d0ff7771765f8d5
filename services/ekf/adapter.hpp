// Connects the filter to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::ekf {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct EkfChannels {
  bus::ChannelList all;
  std::string odometry = all.in("ODOMETRY", "motion without landmarks");
  std::string tracked_landmarks = all.in("TRACKED_LANDMARKS", "consistent detections of one sweep");
  std::string raw_pose = all.in("RAW_POSE", "dead reckoning, for gaps");
  std::string pose = all.out("EKF_POSE", "pose, velocity and biases");
  std::string map = all.out("EKF_MAP", "landmarks of the active state");
  std::string level = all.out("EKF_LEVEL", "error of roll and pitch of the sweeps");
  std::string velocity_correction =
      all.out("VELOCITY_CORRECTION", "velocity and biases, for the input stage");
};

/// The filter as a service: decodes, calls Ekf, publishes. Its state is saved and loaded by the
/// runtime.
bus::Service ekf_service(const EkfChannels& channels = {});

}  // namespace understory::ekf
