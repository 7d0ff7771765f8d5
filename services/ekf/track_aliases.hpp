// Maps tracks to landmarks of the state.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/model/tracked.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/landmark_update.hpp"

namespace understory::ekf {

/// A landmark keeps the id of its first track. Tracks that begin later may be the same landmark.
class TrackAliases {
 public:
  /// Index in `state` of the landmark of `track`; none for an unknown track.
  std::optional<std::uint32_t> landmark_of(const FilterState& state, model::TrackId track) const;
  /// Observations whose track belongs to a landmark of `state`, in the order of `tracks`. Indices
  /// are valid until a landmark leaves the state.
  std::vector<Pairing> known(const FilterState& state,
                             std::span<const model::TrackId> tracks) const;

  /// Assigns `track` to the landmark that began with track `landmark`.
  void set(model::TrackId track, model::TrackId landmark);
  /// Removes all tracks of a landmark.
  void forget_landmark(model::TrackId landmark);
  /// Removes all tracks.
  void clear() { aliases_.clear(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.aliases_);
  }

 private:
  struct Alias {
    model::TrackId track = 0;
    model::TrackId landmark = 0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.track, self.landmark);
    }
  };

  std::vector<Alias> aliases_;  ///< In order of track.
};

}  // namespace understory::ekf
