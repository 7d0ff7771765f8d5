// Recognition of earlier maps.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/model/archive.hpp"
#include "services/geoslam_mapper/smoothing/map_archive.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Overlap of an earlier map with the map in use.
struct Overlap {
  std::uint32_t map_id = 0;       ///< Of the earlier map.
  geometry::SE2 map_T_left;       ///< Frame of the earlier map in the map in use.
  std::vector<MergedPair> pairs;  ///< Common landmarks: of the map in use, of the earlier one.
};

/// Localises new keyframes in the earlier maps (GeoSLAM §7.2.3: a keyframe that matches two maps
/// ties them). One keyframe is not enough: three from different places must agree on the relative
/// pose of the two maps.
class Rejoining {
 public:
  /// Number of keyframes that must agree.
  static constexpr std::size_t kAgree = 3;

  /// Call it after each fused keyframe. `associations`: of the keyframe, with landmarks of the map
  /// in use. Cost: every few metres one search in each earlier map with a graph; nothing if there
  /// is none.
  std::optional<Overlap> follow(const model::Keyframe& keyframe,
                                std::span<const model::Association> associations,
                                const GlobalMap& map, const MapArchive& left);
  /// Starts anew after another map came into use.
  void reset() { found_.clear(); }

  /// Members of a saved state; see common/state. The indexes follow from the maps.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.found_, self.tried_m_);
  }

 private:
  /// A keyframe localised in an earlier map.
  struct Found {
    std::uint32_t map_id = 0;
    geometry::SE2 map_T_left;
    std::vector<MergedPair> pairs;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.map_id, s.map_T_left, s.pairs);
    }
  };
  std::optional<Found> find(const model::Keyframe& keyframe, const geometry::SE2& map_T_centre,
                            std::span<const model::Association> associations, const KeptMap& left);
  std::optional<Overlap> overlap(const Eigen::Vector2d& here_m) const;

  std::map<std::uint32_t, constellation::ConstellationMap> index_;  ///< By map number.
  std::vector<Found> found_;                                        ///< Newest last.
  double tried_m_ = 0.0;  ///< Path length of the vehicle at the last search.
};

}  // namespace understory::geoslam_mapper::smoothing
