// Whether the map still tells where the vehicle is.
#pragma once

#include <map>

#include "common/model/archive.hpp"
#include "common/model/map.hpp"
#include "services/existence_tracker/parameters.hpp"

namespace understory::existence_tracker {

/// What a drive shows of its map on the last metres of path. The question of the thesis (003 §1.7,
/// when mapping should be switched on again) has two sides: landmarks that should have been seen
/// and were not, beyond what the detector misses anyhow, and what is seen and is not in the map.
/// Each landmark counts for the probability that it is one: false detections are neither missing
/// nor new.
class MappingNeed {
 public:
  /// Nothing was driven. `parameters` gives all but the threshold.
  explicit MappingNeed(const NeedParameters& parameters = {}) : parameters_(parameters) {}

  /// So many more landmarks are known of earlier passes: with `min_landmarks` of them there is a
  /// map that can have changed. On a first drive there is none, and mapping goes on anyhow. Until
  /// there is one, what the window has as new is of the earlier pass.
  void know(std::size_t landmarks);
  /// A look at a landmark that the map had, at this path of the vehicle [m]; `probability` that it
  /// existed before the look. One that the window saw as new stays new.
  void look_for(model::LandmarkId id, bool is_hit, double probability, double along_m);
  /// One that the window has brought; `probability` that it is a landmark, 0 where it is not used
  /// yet. It counts from the second time on that it is seen.
  void look_at_new(model::LandmarkId id, bool is_hit, double probability, double along_m);
  /// Forgets what lies behind. O(landmarks around).
  void drive_to(double along_m);

  /// Of the old landmarks that were looked for, those that were not seen once, beyond the share of
  /// `recall` that a pass sees at all; 0 to 1. 0 with fewer than `min_landmarks`.
  double missing_share(double recall) const;
  /// Of the landmarks that were seen, those that are new to the map; 0 to 1. Likewise.
  double new_share() const;

  /// Whether a map of earlier drives has changed so much that it should be mapped again; `recall`
  /// as for missing_share().
  bool is_needed(double recall) const;

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.seen_, self.known_);
  }

 private:
  struct Looked {
    double along_m = 0.0;      ///< At the last look.
    double probability = 0.0;  ///< Of an old one before the first look, of a new one now.
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
