// The methods that `eval large-map` compares, behind one call.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/model/keyframe.hpp"

namespace understory::eval::experiments::large_map {

/// Finds the pose of a keyframe's base in a given map, with no prior and no memory of earlier ones.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  /// map_T_base; none where it is not sure.
  virtual std::optional<geometry::SE2> find(const model::Keyframe& keyframe) const = 0;
  /// Memory that the map takes for each landmark [bytes]; 0 = not known.
  virtual double bytes_per_landmark() const { return 0.0; }  ///< 0 = not known.
};

/// "smoothing" or "baseline" (GeoSLAM algorithms 3 and 4 up to the pose, with its parameters).
std::unique_ptr<PlaceFinder> make_place_finder(std::string_view method,
                                               std::span<const Eigen::Vector2d> landmarks_m);

}  // namespace understory::eval::experiments::large_map
