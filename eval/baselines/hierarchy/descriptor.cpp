#include "eval/baselines/hierarchy/descriptor.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace understory::eval::baselines::hierarchy {

DescriptorMaker::DescriptorMaker(double step) : step_(step), samples_(0) {
  if (!(step >= 1.0 / 64.0 && step < 1.0)) {
    throw std::invalid_argument("descriptor step outside [1/64, 1)");
  }

  samples_ = static_cast<Eigen::Index>(std::ceil(1.0 / step - 1e-9));
  const Eigen::Index bins = samples_ / 2 + 1;
  cosines_.resize(bins, samples_);
  sines_.resize(bins, samples_);

  for (Eigen::Index k = 0; k < bins; ++k) {
    // Bins 0 and (even count) N/2 have no mirror image among the N bins; all others do.
    const bool single = k == 0 || 2 * k == samples_;
    const double weight = single ? 1.0 : std::numbers::sqrt2;
    for (Eigen::Index i = 0; i < samples_; ++i) {
      const double angle = 2.0 * std::numbers::pi * static_cast<double>((k * i) % samples_) /
                           static_cast<double>(samples_);
      cosines_(k, i) = weight * std::cos(angle);
      sines_(k, i) = weight * std::sin(angle);
    }
  }
}

std::vector<Eigen::Vector2d> DescriptorMaker::sample(
    std::span<const Eigen::Vector2d> boundary) const {
  const std::size_t n = boundary.size();
  const auto end_of = [&](std::size_t edge) -> const Eigen::Vector2d& {
    return boundary[(edge + 1) % n];
  };

  double perimeter = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    perimeter += (end_of(i) - boundary[i]).norm();
  }

  std::vector<Eigen::Vector2d> points;
  points.reserve(static_cast<std::size_t>(samples_));
  std::size_t edge = 0;
  double start = 0.0;
  double length = (end_of(0) - boundary[0]).norm();

  for (Eigen::Index i = 0; i < samples_; ++i) {
    const double along = static_cast<double>(i) * step_ * perimeter;
    while (edge + 1 < n && along > start + length) {
      start += length;
      ++edge;
      length = (end_of(edge) - boundary[edge]).norm();
    }
    const double share = length > 0.0 ? (along - start) / length : 0.0;
    points.emplace_back(boundary[edge] + share * (end_of(edge) - boundary[edge]));
  }

  return points;
}

Descriptor DescriptorMaker::operator()(std::span<const Eigen::Vector2d> boundary) const {
  // The mean of the vertices, neither of the samples nor of the area.
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& vertex : boundary) {
    centroid += vertex;
  }

  centroid /= static_cast<double>(boundary.size());
  const std::vector<Eigen::Vector2d> points = sample(boundary);
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 64, 1> radii(samples_);

  for (Eigen::Index i = 0; i < samples_; ++i) {
    radii(i) = (points[static_cast<std::size_t>(i)] - centroid).norm();
  }

  const Descriptor real = cosines_ * radii;
  const Descriptor imaginary = sines_ * radii;

  return (real.array().square() + imaginary.array().square()).sqrt().matrix();
}

}  // namespace understory::eval::baselines::hierarchy
