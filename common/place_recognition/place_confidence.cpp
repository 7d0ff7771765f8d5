#include "common/place_recognition/place_confidence.hpp"

#include <algorithm>
#include <cmath>

namespace understory::place_recognition {
namespace {

/// Uncertainty of the distance of two frames from their truths [m].
constexpr double kTruthSigmaM = 0.15;

}  // namespace

double decades_of(const PlaceAnswer& answer, double radius_m) {
  const PlaceCandidate* best = answer.best();
  if (best == nullptr) return 0.0;
  const Eigen::Vector2d offset = best->frame_T_query.translation();
  const Eigen::Matrix2d rotation = best->frame_T_query.rotation();
  const Eigen::Matrix2d covariance =
      rotation * best->covariance.topLeftCorner<2, 2>() * rotation.transpose();
  const double distance = offset.norm();
  const Eigen::Vector2d along =
      distance > 1e-9 ? Eigen::Vector2d(offset / distance) : Eigen::Vector2d(1.0, 0.0);
  const double sigma = std::sqrt(along.dot(covariance * along) + 2.0 * kTruthSigmaM * kTruthSigmaM);
  const double outside = 0.5 * std::erfc((radius_m - distance) / sigma / std::sqrt(2.0));

  // The likeliest candidate has the evidence; the answer agrees with it.
  const double chance = std::pow(10.0, answer.candidates.front().log10_false_alarm);
  const double elsewhere = std::pow(10.0, -answer.log10_margin);
  return -std::log10(std::max(chance + elsewhere + outside, 1e-300));
}

}  // namespace understory::place_recognition
