#include "services/associator/observation.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace understory::associator {

std::vector<Observation> usable_observations(const model::LandmarkScan& scan) {
  std::vector<Observation> observations;
  observations.reserve(scan.detections.size());
  for (std::uint32_t i = 0; i < scan.detections.size(); ++i) {
    const model::Detection& d = scan.detections[i];
    if (!d.position_m.allFinite() || !d.covariance_m2.allFinite()) continue;
    const Eigen::Matrix2d covariance = d.covariance_m2.topLeftCorner<2, 2>();
    if (covariance.llt().info() != Eigen::Success) continue;
    const double radius = std::isfinite(d.radius_m) ? d.radius_m : 0.0;
    observations.push_back({i, d.position_m.head<2>(), covariance, radius, d.kind});
  }
  return observations;
}

}  // namespace understory::associator
