#include "services/viewer/truth_alignment.hpp"

#include <cmath>

namespace understory::viewer {

void TruthAlignment::add(const Eigen::Vector2d& in_map_m, const Eigen::Vector2d& in_world_m) {
  // Welford's update: no loss of digits far from the origin.
  ++pairs_;
  const double n = static_cast<double>(pairs_);
  const Eigen::Vector2d map_step = in_map_m - mean_map_;
  const Eigen::Vector2d world_step = in_world_m - mean_world_;
  mean_map_ += map_step / n;
  mean_world_ += world_step / n;
  moment_ += map_step * (in_world_m - mean_world_).transpose();
  spread_ += map_step.dot(in_map_m - mean_map_);
}

std::optional<geometry::SE2> TruthAlignment::world_T_map() const {
  if (pairs_ < 3 || spread_ < static_cast<double>(pairs_)) return std::nullopt;
  const double theta = std::atan2(moment_(0, 1) - moment_(1, 0), moment_(0, 0) + moment_(1, 1));
  const geometry::SE2 rotation(0.0, 0.0, theta);
  return geometry::SE2(mean_world_ - rotation * mean_map_, theta);
}

}  // namespace understory::viewer
