// The thesis' polygon descriptor (GeoSLAM §3.2.2), with the dependence on the start vertex that its
// published code has.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace understory::eval::baselines::hierarchy {

/// Magnitudes of the distinct DFT bins of the sampled radii [m]. Bins that the thesis counts twice
/// (the signal is real) carry a factor sqrt(2), so the Euclidean distance of two descriptors is the
/// thesis' distance over all bins. Element 0 is the mean radius times the number of samples.
using Descriptor = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 33, 1>;

/// Computes descriptors with one resolution; holds the DFT's table.
class DescriptorMaker {
 public:
  /// `step` [s]: share of the perimeter between samples, in [1/64, 1).
  explicit DescriptorMaker(double step);

  /// Descriptor of the closed polygon `boundary` [m], sampled from boundary[0] on. It is
  /// invariant to the start only up to whole samples, as in the published code (the text of the
  /// thesis claims more).
  Descriptor operator()(std::span<const Eigen::Vector2d> boundary) const;

 private:
  std::vector<Eigen::Vector2d> sample(std::span<const Eigen::Vector2d> boundary) const;

  double step_;
  Eigen::Index samples_;
  Eigen::MatrixXd cosines_;  ///< bins x samples
  Eigen::MatrixXd sines_;    ///< bins x samples
};

}  // namespace understory::eval::baselines::hierarchy
