#include "deploy/cli/services.hpp"

#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/existence_tracker/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/hesai_driver/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "services/livox_driver/adapter.hpp"
#include "services/loop_closer/adapter.hpp"
#include "services/ouster_driver/adapter.hpp"
#include "services/submap_store/adapter.hpp"
#include "services/velodyne_driver/adapter.hpp"
#include "services/viewer/adapter.hpp"

namespace understory::cli {

std::vector<bus::Service> all_services() {
  return {lidar_imu_input::lidar_imu_input_service(),
          landmark_extractor::landmark_extractor_service(),
          associator::associator_service(),
          ekf::ekf_service(),
          keyframer::keyframer_service(),
          geoslam_mapper::geoslam_mapper_service(),
          submap_store::submap_store_service(),
          loop_closer::loop_closer_service(),
          existence_tracker::existence_tracker_service(),
          viewer::viewer_service()};
}

std::vector<bus::Service> sensor_services() {
  return {velodyne_driver::velodyne_driver_service(), ouster_driver::ouster_driver_service(),
          livox_driver::livox_driver_service(), hesai_driver::hesai_driver_service()};
}

}  // namespace understory::cli
