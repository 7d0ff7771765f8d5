#include "common/io/velodyne_fixes.hpp"

#include <cmath>

namespace understory::io {

std::optional<model::GnssFix> VelodyneFixes::add(const VelodynePosition& position,
                                                 model::Utime received) {
  if (!position.is_valid || last_day_us_ == position.day_us) return std::nullopt;
  last_day_us_ = position.day_us;
  if (!plane_) plane_.emplace(position.latitude_deg, position.longitude_deg);
  model::GnssFix fix;
  fix.utime = received;
  fix.east_north_m = plane_->east_north_m(position.latitude_deg, position.longitude_deg);
  fix.velocity_mps = position.speed_mps *
                     Eigen::Vector2d(std::sin(position.course_rad), std::cos(position.course_rad));
  return fix;
}

}  // namespace understory::io
