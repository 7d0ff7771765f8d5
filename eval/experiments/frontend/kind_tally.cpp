#include "eval/experiments/frontend/kind_tally.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::eval::experiments::frontend {

void KindTally::match(const model::Detection& detection, const TrueLandmark& truth) {
  const Eigen::Vector3d error = detection.position_m - truth.position_m;
  const Eigen::Matrix2d plan = detection.covariance_m2.topLeftCorner<2, 2>();
  sums_.nees_plan += error.head<2>().dot(plan.inverse() * error.head<2>());
  sums_.nees_space += error.dot(detection.covariance_m2.inverse() * error);

  if (truth.position_m.head<2>().norm() <= error_range_m_) {
    square_m2_ += error.head<2>().squaredNorm();
    const Eigen::Vector2d ray = truth.position_m.head<2>().normalized();
    sums_.bias_along_m += ray.dot(error.head<2>());
    sums_.bias_across_m += ray.x() * error.y() - ray.y() * error.x();
    ++near_;
  }

  if (truth.bisector_rad) {
    const double turned =
        std::remainder(detection.bearing_rad - *truth.bisector_rad, 2.0 * std::numbers::pi);
    square_rad2_ += turned * turned;
    sums_.nees_bearing +=
        turned * turned / (detection.bearing_sigma_rad * detection.bearing_sigma_rad);
  }
}

void KindTally::add(const model::LandmarkScan& scan, model::LandmarkKind kind,
                    std::vector<TrueLandmark> truths, std::vector<ExtractionMiss>& misses) {
  for (const model::Detection& detection : scan.detections) {
    if (detection.kind != kind) continue;
    ++sums_.detections;
    TrueLandmark* nearest = nullptr;
    double least = match_m_;
    for (TrueLandmark& truth : truths) {
      const double distance = (detection.position_m - truth.position_m).head<2>().norm();
      if (!truth.is_taken && distance < least) {
        least = distance;
        nearest = &truth;
      }
    }
    if (nearest == nullptr) {
      misses.push_back({scan.utime, true, detection, 0});
      continue;
    }
    nearest->is_taken = true;
    ++sums_.right;
    match(detection, *nearest);
  }

  for (const TrueLandmark& truth : truths) {
    if (!truth.should) continue;
    ++sums_.should;
    if (truth.is_taken) {
      ++sums_.found;
      continue;
    }
    model::Detection missed;
    missed.kind = kind;
    missed.position_m = truth.position_m;
    misses.push_back({scan.utime, false, missed, truth.returns});
  }
}

KindScore KindTally::score() const {
  KindScore score = sums_;
  const double matched = std::max<double>(1.0, static_cast<double>(score.right));
  score.nees_plan /= matched;
  score.nees_space /= matched;
  score.nees_bearing /= matched;
  score.bearing_rms_rad = std::sqrt(square_rad2_ / matched);
  const double counted = std::max<double>(1.0, static_cast<double>(near_));
  score.rms_m = std::sqrt(square_m2_ / counted);
  score.bias_along_m /= counted;
  score.bias_across_m /= counted;
  return score;
}

}  // namespace understory::eval::experiments::frontend
