// Maps that were left.
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

/// A map that is not continued: nothing changes it any more.
struct KeptMap {
  std::uint32_t id = 0;                        ///< Upper 16 bit of its landmarks' ids.
  std::vector<model::MapLandmark> landmarks;   ///< In order of id, with covariances; its own frame.
  std::vector<model::KeyframePose> keyframes;  ///< In order of time, likewise.
  /// Its graph with all that was observed, as common/state writes it; empty in older ones.
  std::string whole;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.landmarks, s.keyframes, s.whole);
  }
};

/// All that is worth keeping where a map is left. Costs about two factorisations.
KeptMap keep(const GlobalMap& map, const CommonError& common);
/// The map as it was kept, with its graph, which it must have. Costs about one factorisation.
GlobalMap opened(const KeptMap& kept, const SmoothingMapperParameters& parameters);

/// The maps that were left, the oldest first. Bounded: a landmark takes 80 bytes, a keyframe 112;
/// the newest kMostWhole have their graph, too (some 200 bytes per observation). Older ones are
/// landmarks and trajectory, and the oldest are forgotten where there are too many.
class MapArchive {
 public:
  static constexpr std::size_t kMost = 16;            ///< Maps.
  static constexpr std::size_t kMostWhole = 2;        ///< Maps that have their graph.
  static constexpr std::size_t kMostParts = 200'000;  ///< Landmarks and keyframes of all maps.

  /// Adds the newest. Returns the maps that were forgotten for it, ascending: their ids are to be
  /// announced.
  std::vector<std::uint32_t> add(KeptMap map);
  /// The map is kept no more: it is part of another one.
  void remove(std::uint32_t id) {
    std::erase_if(maps_, [&](const KeptMap& map) { return map.id == id; });
  }
  /// What is kept, in order of id.
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
