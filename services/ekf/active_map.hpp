// Selects which landmarks are in the filter's state, and for how long.
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
/// state: near landmarks enter it; landmarks that are out of range, missing, or contradict it leave
/// it.
class ActiveMap {
 public:
  ActiveMap(const EkfMapParameters& map, const EkfObservationParameters& observation)
      : map_(map), observation_(observation) {}

  /// Begins the next scan.
  void begin_scan() { ++scan_number_; }
  /// Number of the present scan, counted from 1.
  std::uint64_t scan_number() const { return scan_number_; }

  /// Observations of landmarks of `state`; see TrackAliases::known().
  std::vector<Pairing> known(const FilterState& state, const ScanUpdate& update) const {
    return aliases_.known(state, update.tracks);
  }

  /// Increases the observation's covariance for the error that it shares with earlier observations
  /// of the landmark from places near by. `distance_m`: driven so far.
  void weaken(const Pairing& pairing, double distance_m, FilterState& state,
              ScanUpdate& update) const;
  /// Updates the history and the mean radius of an observed landmark.
  void count_observed(const model::TrackedScan& scan, const Pairing& pairing, FilterState& state,
                      ScanUpdate& update) const;
  /// Pairs the track of an observation with a lost landmark.
  void rejoin(const model::TrackedScan& scan, const Pairing& pairing, FilterState& state,
              ScanUpdate& update);

  /// Adds the observations of unknown tracks as landmarks, none nearer than `min_separation_m` to
  /// another. A full state drops the landmark that is out of view for the longest time.
  void add_new(const model::TrackedScan& scan, double distance_m, const ScanUpdate& update,
               FilterState& state, EkfCounters& counters);
  /// Counts a miss for landmarks in view that the scan did not observe.
  void count_missed(const model::FieldOfView& view, FilterState& state) const;
  /// Removes landmarks that are out of range, missing, or refused too often.
  void remove_stale(const model::FieldOfView& view, FilterState& state, EkfCounters& counters);
  /// Clears all tracks (after a restart).
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
