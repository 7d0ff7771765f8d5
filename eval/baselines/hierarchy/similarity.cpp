#include "eval/baselines/hierarchy/similarity.hpp"

#include <cmath>

namespace understory::eval::baselines::hierarchy {

Eigen::Vector2d Similarity::operator*(const Eigen::Vector2d& point) const {
  return {cosine * point.x() - sine * point.y() + translation_m.x(),
          sine * point.x() + cosine * point.y() + translation_m.y()};
}

Similarity Similarity::operator*(const Similarity& other) const {
  return {cosine * other.cosine - sine * other.sine, sine * other.cosine + cosine * other.sine,
          *this * other.translation_m};
}

geometry::SE2 Similarity::pose() const { return {translation_m, std::atan2(sine, cosine)}; }

std::optional<Similarity> fit_similarity(std::span<const Eigen::Vector2d> from,
                                         std::span<const Eigen::Vector2d> to) {
  if (from.size() < 2) {
    return std::nullopt;
  }

  Eigen::Vector2d mean_from = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_to = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    mean_from += from[i];
    mean_to += to[i];
  }

  mean_from /= static_cast<double>(from.size());
  mean_to /= static_cast<double>(from.size());
  double dot = 0.0;
  double cross = 0.0;
  double square = 0.0;

  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector2d p = from[i] - mean_from;
    const Eigen::Vector2d q = to[i] - mean_to;
    dot += p.dot(q);
    cross += p.x() * q.y() - p.y() * q.x();
    square += p.squaredNorm();
  }

  if (!(square > 0.0)) {
    return std::nullopt;
  }

  Similarity fit{dot / square, cross / square, Eigen::Vector2d::Zero()};
  fit.translation_m = mean_to - fit * mean_from;

  return fit;
}

}  // namespace understory::eval::baselines::hierarchy
