// The input stage's process. Its channels: LidarImuInputChannels in adapter.hpp, and --help.
#include "services/lidar_imu_input/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::lidar_imu_input::lidar_imu_input_service(), argc,
                                      argv);
}
