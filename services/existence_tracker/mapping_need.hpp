// Whether the map is still sufficient for localisation.
#pragma once

#include <map>

#include "common/model/archive.hpp"
#include "common/model/map.hpp"
#include "services/existence_tracker/parameters.hpp"

namespace understory::existence_tracker {

/// Evidence of a drive about its map over the last metres of path. The question of the thesis (003
/// §1.7, when mapping should be switched on again) has two sides: expected landmarks that were not
/// seen, beyond the detector's own misses, and landmarks that are seen but not in the map. Each
/// landmark counts with its probability: false detections are neither missing nor new.
class MappingNeed {
 public:
  /// No path yet. `parameters` gives all but the threshold.
  explicit MappingNeed(const NeedParameters& parameters = {}) : parameters_(parameters) {}

  /// Adds to the number of landmarks from earlier passes: with `min_landmarks` of them there is a
  /// map that can have changed. On a first drive there is none, and mapping is on anyhow. Until
  /// there is one, new landmarks in the window count as landmarks of the earlier pass.
  void know(std::size_t landmarks);
  /// A look at a landmark of the map, at this path length [m]; `probability`: that it existed
  /// before the look. A landmark that was new in the window stays new.
  void look_for(model::LandmarkId id, bool is_hit, double probability, double along_m);
  /// A look at a new landmark of the window; `probability`: that it is a landmark, 0 if it is not
  /// used yet. It counts from its second sighting.
  void look_at_new(model::LandmarkId id, bool is_hit, double probability, double along_m);
  /// Drops looks behind the window. O(landmarks around).
  void drive_to(double along_m);

  /// Share of the old landmarks that were looked for but never seen, beyond the share 1 - `recall`
  /// that a pass misses anyhow; 0 to 1. 0 with fewer than `min_landmarks`.
  double missing_share(double recall) const;
  /// Share of the seen landmarks that are new to the map; 0 to 1. Likewise.
  double new_share() const;

  /// Whether a map of earlier drives has changed so much that it must be mapped again; `recall` as
  /// for missing_share().
  bool is_needed(double recall) const;

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.seen_, self.known_);
  }

 private:
  struct Looked {
    double along_m = 0.0;      ///< At the last look.
    double probability = 0.0;  ///< Of an old landmark before the first look, of a new one now.
    int looks = 0;
    bool was_hit = false;
    bool is_old = false;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.along_m, s.probability, s.looks, s.was_hit, s.is_old);
    }
  };
  bool has_map() const;

  NeedParameters parameters_;
  std::map<model::LandmarkId, Looked> seen_;
  std::uint64_t known_ = 0;  ///< Landmarks of earlier passes.
};

}  // namespace understory::existence_tracker
