// Which landmarks are in the filter's state, and for how long.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/tracked.hpp"
#include "services/ekf/counters.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/scan_update.hpp"
#include "services/ekf/track_aliases.hpp"

namespace understory::ekf {

/// Owner of the tracks' landmarks and of the number of scans. The landmarks themselves are in the
/// state: near landmarks enter it, those out of range, missing, or at odds with it leave it.
class ActiveMap {
 public:
  ActiveMap(const EkfMapParameters& map, const EkfObservationParameters& observation)
      : map_(map), observation_(observation) {}

  /// The next scan begins.
  void begin_scan() { ++scan_number_; }
  /// Number of the scan at hand, counted from 1.
  std::uint64_t scan_number() const { return scan_number_; }

  /// Observations of landmarks of `state`; see TrackAliases::known().
  std::vector<Pairing> known(const FilterState& state, const ScanUpdate& update) const {
    return aliases_.known(state, update.tracks);
  }

  /// Increases the observation's covariance for the part of its error that it has in common with
  /// earlier observations of the landmark from the places near by. `distance_m`: driven so far.
  void weaken(const Pairing& pairing, double distance_m, FilterState& state,
              ScanUpdate& update) const;
  /// The landmark was observed: its history and mean radius.
  void count_observed(const model::TrackedScan& scan, const Pairing& pairing, FilterState& state,
                      ScanUpdate& update) const;
  /// The track of an observation is a landmark that was lost.
  void rejoin(const model::TrackedScan& scan, const Pairing& pairing, FilterState& state,
              ScanUpdate& update);

  /// Adds the observations of unknown tracks as landmarks, none nearer than `min_separation_m` to
  /// another. A full state gives up the landmark that is out of view for longest.
  void add_new(const model::TrackedScan& scan, double distance_m, const ScanUpdate& update,
               FilterState& state, EkfCounters& counters);
  /// Counts the scan at landmarks in view that it did not observe.
  void count_missed(const model::FieldOfView& view, FilterState& state) const;
  /// Removes landmarks that are out of range, missing, or refused too often.
  void remove_stale(const model::FieldOfView& view, FilterState& state, EkfCounters& counters);
  /// Forgets all tracks (after a restart).
  void clear() { aliases_.clear(); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.aliases_, self.scan_number_);
  }

 private:
  bool is_near_old(const FilterState& state, const Eigen::Vector2d& position) const;
  bool make_room(const model::FieldOfView& view, FilterState& state, EkfCounters& counters);
  void remove(std::size_t landmark, FilterState& state, EkfCounters& counters);

  EkfMapParameters map_;
  EkfObservationParameters observation_;
  TrackAliases aliases_;
  std::uint64_t scan_number_ = 0;
};

}  // namespace understory::ekf
