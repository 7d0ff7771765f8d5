// Connects the mapper to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::geoslam_mapper {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct MapperChannels {
  bus::ChannelList all;
  std::string keyframe = all.in("KEYFRAME", "local landmarks of n sweeps");
  std::string landmarks = all.in("LANDMARKS", "every sweep, located at once");
  std::string view_ranges = all.in("VIEW_RANGES", "free range of each sweep, by bearing");
  std::string odometry = all.in("ODOMETRY", "motion without landmarks, if available");
  std::string rest_level =
      all.in("REST_LEVEL", "level error of the stationary vehicle, learned from motion");
  std::string ekf_pose = all.in("EKF_POSE", "motion as a gate; velocity if there are no wheels");
  std::string ekf_level = all.in("EKF_LEVEL", "error of roll and pitch of the sweeps");
  std::string map_request = all.in("MAP_REQUEST", "request for MAP");
  std::string given_map = all.in("GIVEN_MAP", "a map to start with");
  std::string submap_stored = all.in("SUBMAP_STORED", "the store has a submap on disk");
  std::string submap_reply = all.in("SUBMAP_REPLY", "a submap requested by SUBMAP_QUERY");
  std::string loop_closure = all.in("LOOP_CLOSURE", "two places and their relative pose");
  std::string existence = all.in("EXISTENCE", "landmarks that are in use or out of use");
  std::string slam_pose = all.out("SLAM_POSE", "pose of the vehicle at each sweep");
  std::string slam_update = all.out("SLAM_UPDATE", "result of each keyframe");
  std::string map = all.out("MAP", "the whole map: rarely, at the end and on request");
  std::string map_delta = all.out("MAP_DELTA", "changes of the map, per keyframe");
  std::string submap = all.out("SUBMAP", "a submap far from the vehicle, for the store");
  std::string submap_query =
      all.out("SUBMAP_QUERY", "request to the store for submaps near the vehicle");
  std::string map_correction = all.out("MAP_CORRECTION", "poses of the submaps");
  std::string loop_result =
      all.out("LOOP_RESULT", "whether a closure was accepted or refused, and why");
};

/// The mapper as a service: its name, its channels and the factory of its adapter.
bus::Service geoslam_mapper_service(const MapperChannels& channels = {});

}  // namespace understory::geoslam_mapper
