// Positions of the landmarks of the map.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/slam_output.hpp"

namespace understory::existence_tracker {

/// Positions by id, frame `map`, from MAP and MAP_DELTA. Landmarks that the mapper handed over to
/// the store keep their position.
class LandmarkPlaces {
 public:
  /// Adds the landmarks of a map; others stay.
  void take(const model::WholeMap& map);
  /// Applies a change. O(changes).
  void take(const model::MapDelta& delta);

  /// Position of a landmark [m]; none if no message gave it.
  std::optional<Eigen::Vector2d> at(model::LandmarkId id) const;
  /// Ids of the landmarks within `radius_m` of a position. O(landmarks around).
  std::vector<model::LandmarkId> near(const Eigen::Vector2d& place_m, double radius_m) const;
  /// Number of landmarks.
  std::size_t size() const { return places_m_.size(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.places_m_);
    if constexpr (!std::is_const_v<Self>) self.fill_cells();
  }

 private:
  using Cell = std::pair<int, int>;
  static Cell cell_of(const Eigen::Vector2d& place_m);
  void place(model::LandmarkId id, const Eigen::Vector2d& place_m);
  void erase(model::LandmarkId id);
  void leave_cell(model::LandmarkId id, const Eigen::Vector2d& place_m);
  void fill_cells();

  std::map<model::LandmarkId, Eigen::Vector2d> places_m_;
  std::map<Cell, std::vector<std::pair<model::LandmarkId, Eigen::Vector2d>>> cells_;
};

}  // namespace understory::existence_tracker
