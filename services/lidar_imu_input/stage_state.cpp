// Saving and loading the stage.
#include <stdexcept>
#include <utility>

#include "common/model/archive.hpp"
#include "common/state/archive.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr state::Format kFormat{"lidar_imu_input", 15};

}  // namespace

std::string LidarImuInput::save() const { return state::save(kFormat, *this); }

void LidarImuInput::load(const std::string& state) {
  LidarImuInput loaded(parameters_);
  state::load(state, kFormat, loaded);
  if (!loaded.motion_.is_whole()) throw std::invalid_argument("state: it is not whole");

  *this = std::move(loaded);
}

}  // namespace understory::lidar_imu_input
