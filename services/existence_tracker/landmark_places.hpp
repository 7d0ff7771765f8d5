// Where the landmarks of the map are.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>

#include "common/model/archive.hpp"
#include "common/model/slam_output.hpp"

namespace understory::existence_tracker {

/// Positions by id, frame `map`, by MAP and MAP_DELTA. Landmarks that the mapper handed over to the
/// store stay as they were.
class LandmarkPlaces {
 public:
  /// Those of a map: what is known beside them stays.
  void take(const model::WholeMap& map);
  /// What changed. O(changes).
  void take(const model::MapDelta& delta);

  /// Where a landmark is [m]; none where no message said so.
  std::optional<Eigen::Vector2d> at(model::LandmarkId id) const;
  /// Number of landmarks.
  std::size_t size() const { return places_m_.size(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.places_m_);
  }

 private:
  std::map<model::LandmarkId, Eigen::Vector2d> places_m_;
};

}  // namespace understory::existence_tracker
