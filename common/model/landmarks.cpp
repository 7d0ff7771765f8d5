#include "common/model/landmarks.hpp"

#include <cmath>

#include "common/geometry/se2.hpp"

namespace understory::model {

bool FieldOfView::contains(const Eigen::Vector2d& position_in_vehicle_m) const {
  if (position_in_vehicle_m.squaredNorm() > max_range_m * max_range_m) return false;
  if (width_rad >= 2.0 * std::numbers::pi) return true;
  const double bearing = std::atan2(position_in_vehicle_m.y(), position_in_vehicle_m.x());
  return std::abs(geometry::wrap_angle(bearing - bearing_rad)) <= 0.5 * width_rad;
}

}  // namespace understory::model
