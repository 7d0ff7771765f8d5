// Clustering of all landmarks of a keyframe (GeoSLAM §4.5.5).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::eval::baselines::keyframer {

/// Single-linkage clusters of `points` [m]: two points within `tolerance_m` are in one cluster, as
/// in PCL's EuclideanClusterExtraction. Only clusters of `min_size` to `max_size` points, as
/// indices; the largest first, then by lowest index. Cost O(n log n) for scattered points.
std::vector<std::vector<std::uint32_t>> single_linkage(std::span<const Eigen::Vector2d> points,
                                                       double tolerance_m, std::size_t min_size,
                                                       std::size_t max_size);

}  // namespace understory::eval::baselines::keyframer
