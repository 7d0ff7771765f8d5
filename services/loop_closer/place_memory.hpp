// The places of the drive so far.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/place_scan.hpp"
#include "common/model/submap.hpp"
#include "common/place_recognition/level_stems.hpp"

namespace understory::loop_closer {

using place_recognition::LevelStem;

/// Pose of a keyframe in a submap that the mapper has handed over.
struct InSubmap {
  model::SubmapId id = 0;
  geometry::SE2WithCovariance submap_T_base;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.submap_T_base);
  }
};

/// Stems (and points) around the base of one keyframe.
struct Place {
  std::uint64_t keyframe = 0;  ///< Its sequence.
  model::Utime utime = 0;
  std::uint32_t map_id = 1;
  double along_m = 0.0;  ///< Path of the vehicle.
  /// The mapper's pose when the keyframe arrived: later corrections are within its covariance.
  geometry::SE2WithCovariance map_T_base;
  std::optional<InSubmap> in_submap;  ///< None while the mapper holds the keyframe.
  std::vector<LevelStem> stems;       ///< Frame `vehicle_level` of the base.
  /// Same frame; empty if no method compares clouds.
  std::vector<model::PlacePoint> cloud;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.keyframe, s.utime, s.map_id, s.along_m, s.map_T_base, s.in_submap);
    auto count = static_cast<std::uint64_t>(s.stems.size());
    a(count);
    if constexpr (Archive::kReads) s.stems.resize(count);
    for (auto& stem : s.stems) a(stem.position_m, stem.diameter_m);
    a(s.cloud);
  }
};

/// Places in order of time. Memory per place: about 100 bytes, 24 for each stem and 6 for each
/// point.
class PlaceMemory {
 public:
  /// Adds a place. Precondition: its keyframe is later than those before.
  void add(Place place) { places_.push_back(std::move(place)); }
  /// Records which keyframes went into a submap. O(keyframes of it log places).
  void follow(const model::Submap& submap);

  /// All of them.
  std::span<const Place> places() const { return places_; }
  /// The place of a keyframe; null if it has none. O(log places).
  const Place* of_keyframe(std::uint64_t keyframe) const;
  /// Number of places at or before this path length [m]. O(log places).
  std::size_t count_until(double along_m) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.places_);
  }

 private:
  std::vector<Place> places_;
};

}  // namespace understory::loop_closer
