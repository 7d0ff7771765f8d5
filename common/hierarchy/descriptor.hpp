// Shape descriptor of a polygon, invariant to pose and first vertex.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace understory::hierarchy {

/// Largest number of distinct bins of a descriptor: descriptor_step >= 1/30.
inline constexpr std::size_t kMaxDescriptorBins = 16;

/// Magnitudes of the spectrum of the distance to the centroid along the perimeter (GeoSLAM §3.2.2)
/// [m, times the number of samples]. Bin 0 is the mean distance. Unused bins are zero.
///
/// The thesis samples 1/s points from an arbitrary vertex and uses all 1/s bins of their DFT. The
/// result depends on the vertex by as much as the threshold tau. Here the Fourier integral along
/// the edges is used, which the samples approximate. Only the distinct bins 0 ... 1/(2s) are
/// stored; all but bin 0 are weighted by sqrt(2), for their mirror images. So Euclidean distances
/// and tau have the units of the thesis.
using Descriptor = std::array<float, kMaxDescriptorBins>;

/// Number of samples 1/s of a step. Precondition: 1/30 <= step <= 1/4.
int sample_count(double descriptor_step);

/// Descriptor of the closed walk along `boundary` [m]. Its centroid is the mean of the vertices, as
/// in the thesis. `samples` is 1/s. Invariant to rotation, translation, reflection, first vertex
/// and direction of travel up to rounding. Precondition: at least two vertices, not all equal.
Descriptor describe(std::span<const Eigen::Vector2d> boundary, int samples);

/// Euclidean distance, to be compared with tau.
float distance(const Descriptor& a, const Descriptor& b);

}  // namespace understory::hierarchy
