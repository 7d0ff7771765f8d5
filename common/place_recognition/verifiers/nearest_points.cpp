#include "common/place_recognition/verifiers/nearest_points.hpp"

#include <nanoflann.hpp>
#include <utility>

namespace understory::place_recognition::verifiers {

struct NearestPoints::Tree {
  /// nanoflann's interface of a set of points; names are nanoflann's.
  struct Cloud {
    std::vector<Eigen::Vector3d> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t index, std::size_t axis) const {
      return points[index][static_cast<Eigen::Index>(axis)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>,
                                                    Cloud, 3, std::uint32_t>;

  explicit Tree(std::vector<Eigen::Vector3d> points)
      : cloud{std::move(points)}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    index.buildIndex();
  }

  Cloud cloud;
  Index index;
};

NearestPoints::NearestPoints(std::vector<Eigen::Vector3d> points_m)
    : tree_(std::make_unique<Tree>(std::move(points_m))) {}
NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

std::optional<std::uint32_t> NearestPoints::nearest(const Eigen::Vector3d& at_m,
                                                    double radius_m) const {
  std::uint32_t index = 0;
  double squared = 0.0;
  if (tree_->index.knnSearch(at_m.data(), 1, &index, &squared) == 0) return std::nullopt;
  return squared <= radius_m * radius_m ? std::optional(index) : std::nullopt;
}

std::vector<std::uint32_t> NearestPoints::nearest(const Eigen::Vector3d& at_m, std::size_t count,
                                                  double radius_m) const {
  std::vector<std::uint32_t> indices(count);
  std::vector<double> squared(count);
  std::size_t found = tree_->index.knnSearch(at_m.data(), count, indices.data(), squared.data());
  while (found > 0 && squared[found - 1] > radius_m * radius_m) --found;
  indices.resize(found);
  return indices;
}

std::span<const Eigen::Vector3d> NearestPoints::points_m() const { return tree_->cloud.points; }

}  // namespace understory::place_recognition::verifiers
