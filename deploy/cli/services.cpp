#include "deploy/cli/services.hpp"

#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "services/velodyne_driver/adapter.hpp"

namespace understory {

std::vector<Service> all_services() {
  return {lidar_imu_input_service(), landmark_extractor_service(),
          associator_service(),      ekf_service(),
          keyframer_service(),       geoslam_mapper_service()};
}

std::vector<Service> sensor_services() { return {velodyne_driver_service()}; }

}  // namespace understory
