#include "common/foxglove/travelled_path.hpp"

namespace understory::foxglove {

bool TravelledPath::add(const model::SlamPose& pose) {
  if (pose.map_id != map_id_) *this = TravelledPath(most_);
  map_id_ = pose.map_id;
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  if (!poses_.empty() &&
      (poses_.back().translation() - map_T_vehicle.translation()).norm() < spacing_m_) {
    return false;
  }

  poses_.push_back(map_T_vehicle);
  if (poses_.size() <= most_) return true;
  std::vector<geometry::SE2> kept;
  for (std::size_t i = 0; i < poses_.size(); i += 2) kept.push_back(poses_[i]);
  poses_ = std::move(kept);
  spacing_m_ *= 2.0;
  return true;
}

}  // namespace understory::foxglove
