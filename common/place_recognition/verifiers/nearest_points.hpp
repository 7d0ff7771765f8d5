// Nearest neighbours in a cloud of points, by nanoflann.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace understory::place_recognition::verifiers {

/// A k-d tree over points.
class NearestPoints {
 public:
  /// Copies the points [m]. Precondition: all are finite.
  explicit NearestPoints(std::vector<Eigen::Vector3d> points_m);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  NearestPoints& operator=(NearestPoints&&) noexcept;

  /// Index of the nearest point within `radius_m`; none where there is none.
  std::optional<std::uint32_t> nearest(const Eigen::Vector3d& at_m, double radius_m) const;
  /// Indices of at most `count` points within `radius_m`, the nearest first.
  std::vector<std::uint32_t> nearest(const Eigen::Vector3d& at_m, std::size_t count,
                                     double radius_m) const;

  /// The points.
  std::span<const Eigen::Vector3d> points_m() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace understory::place_recognition::verifiers
