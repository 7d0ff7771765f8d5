// The mapper's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::geoslam_mapper {

/// Names of the channels; see the README for what each carries.
struct MapperChannels {
  // In.
  std::string keyframe = "KEYFRAME";
  std::string landmarks = "LANDMARKS";
  std::string view_ranges = "VIEW_RANGES";
  std::string odometry = "ODOMETRY";
  std::string rest_level = "REST_LEVEL";
  std::string ekf_pose = "EKF_POSE";
  std::string ekf_level = "EKF_LEVEL";
  std::string map_request = "MAP_REQUEST";
  std::string given_map = "GIVEN_MAP";
  std::string submap_stored = "SUBMAP_STORED";
  std::string submap_reply = "SUBMAP_REPLY";
  std::string loop_closure = "LOOP_CLOSURE";
  std::string existence = "EXISTENCE";
  // Out.
  std::string slam_pose = "SLAM_POSE";
  std::string slam_update = "SLAM_UPDATE";
  std::string map = "MAP";
  std::string map_delta = "MAP_DELTA";
  std::string submap = "SUBMAP";
  std::string submap_query = "SUBMAP_QUERY";
  std::string map_correction = "MAP_CORRECTION";
  std::string loop_result = "LOOP_RESULT";
};

/// The mapper as a service: name, channels and what makes its adapter.
bus::Service geoslam_mapper_service(const MapperChannels& channels = {});

}  // namespace understory::geoslam_mapper
