// Is it a stem or a strip of a wall?
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "services/landmark_extractor/trunks/column_fit.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

/// Points scatter across a plane at least so much, however it is looked at.
constexpr double kLeastAcross_m = 0.003;

double square(double value) { return value * value; }

}  // namespace

/// A strip of a wall looks like a thick stem of which little is seen.
void StemFitter::compare_with_plane(const Vector6d& state, StemFit& fit) {
  const auto visit = [&](const auto& see) {
    for (const HitLanes& group : used_hits_) {
      for (std::size_t l = 0; l < kLanes && group.counts[l] > 0.0F; ++l) {
        const Eigen::Vector2d along(group.along_x[l], group.along_y[l]);
        see(Eigen::Vector2d(group.origin_x[l], group.origin_y[l]) + group.range[l] * along, along);
      }
    }
  };
  double count = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square_sum = Eigen::Matrix2d::Zero();
  visit([&](const Eigen::Vector2d& point, const Eigen::Vector2d& /*along*/) {
    count += 1.0;
    mean += point;
    square_sum += point * point.transpose();
  });
  mean /= count;
  const Eigen::Matrix2d scatter = square_sum / count - mean * mean.transpose();
  const double angle = 0.5 * std::atan2(2.0 * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
  const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d normal(-direction.y(), direction.x());
  double least = 0.0;
  double most = 0.0;
  double flat = 0.0;
  visit([&](const Eigen::Vector2d& point, const Eigen::Vector2d& along) {
    const double place = direction.dot(point - mean);
    least = std::min(least, place);
    most = std::max(most, place);
    flat += square(normal.dot(point - mean)) /
            (square(sweep_.range_sigma_m * normal.dot(along)) + square(trunk_.roundness_sigma_m) +
             square(kLeastAcross_m));
  });
  hit_means_.resize(used_hits_.size());
  square_terms(used_hits_, {}, stem_of(state), noise_, hit_means_, {});
  double round = 0.0;
  for (std::size_t k = 0; k < used_hits_.size(); ++k) {
    for (const float counts : used_hits_[k].counts) round += counts * hit_means_[k];
  }
  fit.width_m = most - least;
  fit.flat_excess = flat - round;
}

}  // namespace understory::landmark_extractor::trunks
