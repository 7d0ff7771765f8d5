#include "services/landmark_extractor/trunks/column_plane.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "services/landmark_extractor/square.hpp"
#include "services/landmark_extractor/trunks/stem_evidence.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

/// Least scatter of points across a plane, from any direction.
constexpr double kLeastAcross_m = 0.003;

}  // namespace

PlaneComparison compare_with_plane(const std::vector<HitLanes>& hits, const StemState& stem,
                                   const BeamNoise& noise, const SweepParameters& sweep,
                                   const SweepTrunkParameters& trunk) {
  const auto visit = [&](const auto& see) {
    for (const HitLanes& group : hits) {
      for (std::size_t l = 0; l < kLanes && group.counts[l] > 0.0F; ++l) {
        const Eigen::Vector2d along(group.along_x[l], group.along_y[l]);
        see(Eigen::Vector2d(group.origin_x[l], group.origin_y[l]) + group.range[l] * along, along);
      }
    }
  };

  // Direction of the plane.
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

  // Extent along it and squared residuals across it.
  double least = 0.0;
  double most = 0.0;
  double flat = 0.0;
  visit([&](const Eigen::Vector2d& point, const Eigen::Vector2d& along) {
    const double place = direction.dot(point - mean);
    least = std::min(least, place);
    most = std::max(most, place);
    flat += square(normal.dot(point - mean)) /
            (square(sweep.range_sigma_m * normal.dot(along)) + square(trunk.roundness_sigma_m) +
             square(kLeastAcross_m));
  });

  // Likewise for the stem.
  std::array<float, kMaxRuns> hit_means{};
  square_terms(hits, {}, stem, noise, std::span(hit_means).first(hits.size()), {});
  double round = 0.0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    for (const float counts : hits[k].counts) round += counts * hit_means[k];
  }
  return {most - least, flat - round};
}

}  // namespace understory::landmark_extractor::trunks
