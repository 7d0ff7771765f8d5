// Earlier maps that are no longer in use.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/map.hpp"
#include "services/geoslam_mapper/smoothing/told_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A map that is not continued: it changes no more.
struct KeptMap {
  std::uint32_t id = 0;                        ///< Upper 16 bit of its landmarks' ids.
  std::vector<model::MapLandmark> landmarks;   ///< In order of id, with covariances; its own frame.
  std::vector<model::KeyframePose> keyframes;  ///< In order of time, likewise.
  /// Its graph with all observations, in the format of common/state; empty in older maps.
  std::string whole;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.landmarks, s.keyframes, s.whole);
  }
};

/// Makes the archive entry of a map. Cost: about two factorisations.
KeptMap keep(const GlobalMap& map, const CommonError& common);
/// Restores a map from its entry, which must have the graph. Cost: about one factorisation.
GlobalMap opened(const KeptMap& kept, const SmoothingMapperParameters& parameters);

/// The earlier maps, the oldest first. Bounded: a landmark takes 80 bytes, a keyframe 112; the
/// newest kMostWhole also have their graph (some 200 bytes per observation). Older ones have
/// landmarks and trajectory only; beyond the limits the oldest are deleted.
class MapArchive {
 public:
  static constexpr std::size_t kMost = 16;            ///< Maps.
  static constexpr std::size_t kMostWhole = 2;        ///< Maps that have their graph.
  static constexpr std::size_t kMostParts = 200'000;  ///< Landmarks and keyframes of all maps.

  /// Adds the newest map. Returns the maps that were deleted for it, ascending: their ids are to be
  /// announced.
  std::vector<std::uint32_t> add(KeptMap map);
  /// Removes a map that became part of another one.
  void remove(std::uint32_t id) {
    std::erase_if(maps_, [&](const KeptMap& map) { return map.id == id; });
  }
  /// The maps, in order of id.
  const std::deque<KeptMap>& maps() const { return maps_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.maps_);
  }

 private:
  std::deque<KeptMap> maps_;
};

}  // namespace understory::geoslam_mapper::smoothing
