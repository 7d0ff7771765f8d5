// Similar triangles of stems, their implied poses, and clusters of these poses.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/constellation/triangles.hpp"
#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition {

/// The pose implied by a triangle of a query that is similar to one of a frame.
struct Hypothesis {
  std::uint32_t frame = 0;  ///< In the order of adding.
  float x_m = 0.0F;         ///< Position of the query in the frame.
  float y_m = 0.0F;
  float heading_rad = 0.0F;
};

/// Limits for similar triangles.
struct HypothesisFilter {
  double side_tolerance_m = 0.25;
  /// Largest difference between the logarithms of a corner's diameters.
  double diameter_log_tolerance = 1e9;
  double max_distance_m = 12.0;           ///< Largest distance between the sensors.
  std::uint32_t end = ~std::uint32_t{0};  ///< Frames from this one on are not searched.
};

/// Triangles of many frames by their side lengths.
class TripletIndex {
 public:
  /// An empty index. Look-ups are fastest with about this tolerance [m].
  explicit TripletIndex(double side_tolerance_m) : triangles_(2.0 * side_tolerance_m) {}

  /// Adds the next frame and its triangles.
  void add(std::span<const LevelStem> stems, std::span<const StemTriangle> triangles);
  /// Poses by frame. O(triangles of the query * similar ones).
  std::vector<Hypothesis> hypotheses(std::span<const LevelStem> stems,
                                     std::span<const StemTriangle> triangles,
                                     const HypothesisFilter& filter) const;

 private:
  struct IndexedStem {
    Eigen::Vector2f position_m;
    float log_diameter = 0.0F;  ///< NaN where unknown.
    std::uint32_t frame = 0;
  };

  constellation::TriangleIndex triangles_;
  std::vector<IndexedStem> stems_;  // by slot
  std::uint32_t frames_ = 0;
};

/// A start pose for the verification, and the number of its triangles.
struct PlaceCluster {
  std::uint32_t frame = 0;
  std::uint32_t votes = 0;
  geometry::SE2 frame_T_query;
};

/// Adds the largest clusters of one frame's hypotheses. O(n^2) of the first 400.
void collect_clusters(std::span<const Hypothesis> of_one_frame,
                      std::vector<PlaceCluster>& clusters);

}  // namespace understory::place_recognition
