// Maps that were left, found again.
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

/// That a map which was left overlaps with the one in use.
struct Overlap {
  std::uint32_t map_id = 0;       ///< Of the one that was left.
  geometry::SE2 map_T_left;       ///< Its frame in the map in use.
  std::vector<MergedPair> pairs;  ///< Landmarks that are one: of the map in use, of the other one.
};

/// Looks for the places of new keyframes in the maps that were left (GeoSLAM §7.2.3: a keyframe
/// that matches two maps ties them). One keyframe proves nothing: three from different places must
/// agree on how the two maps lie to each other.
class Rejoining {
 public:
  /// So many keyframes must agree.
  static constexpr std::size_t kAgree = 3;

  /// To be called after each keyframe that was fused. `associations`: of the keyframe, with
  /// landmarks of the map in use. Cost: every few metres, one search in each map that was left and
  /// has its graph; nothing where there is none.
  std::optional<Overlap> follow(const model::Keyframe& keyframe,
                                std::span<const model::Association> associations,
                                const GlobalMap& map, const MapArchive& left);
  /// Begins anew: another map is in use.
  void reset() { found_.clear(); }

  /// Members of a saved state; see common/state. The indexes follow from the maps.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.found_, self.tried_m_);
  }

 private:
  /// A keyframe's place in a map that was left.
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

  std::map<std::uint32_t, constellation::ConstellationMap> index_;  ///< By map.
  std::vector<Found> found_;                                        ///< The newest last.
  double tried_m_ = 0.0;  ///< Path of the vehicle at the last search.
};

}  // namespace understory::geoslam_mapper::smoothing
