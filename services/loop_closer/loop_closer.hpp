// Looks for places of the drive where the vehicle has been before.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/submap.hpp"
#include "services/loop_closer/known_ground.hpp"
#include "services/loop_closer/parameters.hpp"
#include "services/loop_closer/place_clouds.hpp"
#include "services/loop_closer/place_memory.hpp"
#include "services/loop_closer/place_search.hpp"
#include "services/loop_closer/place_window.hpp"
#include "services/loop_closer/sent_closures.hpp"

namespace understory::loop_closer {

/// What happened since the first start (a saved state includes it).
struct LoopCounters {
  std::uint64_t keyframes = 0;          ///< That the mapper placed.
  std::uint64_t keyframes_missing = 0;  ///< Updates of keyframes that did not come.
  std::uint64_t places = 0;             ///< Kept.
  std::uint64_t without_cloud = 0;      ///< Places left out: clouds are compared, none came.
  std::uint64_t queries = 0;            ///< Looked for.
  std::uint64_t sent = 0;               ///< Closures.
  std::uint64_t unexpected = 0;         ///< Of these, against what the mapper's poses allow.
  std::uint64_t accepted = 0;           ///< By the mapper at once.
  std::uint64_t waiting = 0;            ///< At the mapper, for others that agree.
  std::uint64_t refused = 0;            ///< By the mapper.
  std::uint64_t revoked = 0;            ///< By anybody.
  std::uint64_t other_map = 0;          ///< Places found that are of a map that was left.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.keyframes, s.keyframes_missing, s.places, s.without_cloud, s.queries, s.sent, s.unexpected,
      s.accepted, s.waiting, s.refused, s.revoked, s.other_map);
  }
};

/// The stage. Every few metres what was seen on the last ones becomes a place. It is looked for
/// among all places of the drive that lie a good way back, unless the mapper is on ground that it
/// knows already; a place that is found for sure is told to the mapper as a loop closure (thesis
/// 002 §2.4, §6.3). The mapper decides what counts: see its smoothing/closures.hpp.
class LoopCloser {
 public:
  /// Without places.
  explicit LoopCloser(const LoopCloserParameters& parameters);

  /// A keyframe; its update must come later. At most kMostPending wait.
  void add(const model::Keyframe& keyframe);
  /// A cloud of one of its scans; the keyframe's update must come later. Ignored where nobody
  /// compares clouds.
  void add(const model::PlaceScan& scan);
  /// What became of a keyframe. Gives the loop closure that it shows, if any. Cost: one search
  /// every `every_m` metres.
  std::optional<model::LoopClosure> add(const model::MapUpdate& update);
  /// A part of the map that the mapper has given away: its keyframes are ends by their submap now.
  void add(const model::Submap& submap) { memory_.follow(submap); }
  /// What the mapper did with a closure; false where it is none of ours.
  bool add(const model::LoopResult& result);

  /// Counts for HEALTH and tests.
  const LoopCounters& counters() const { return counters_; }
  /// The places that are kept.
  const PlaceMemory& memory() const { return memory_; }

  /// The whole state, for a restart. O(places).
  std::string save() const;
  /// Continues from what save() gave, with the same output. Throws std::invalid_argument on other
  /// bytes; the state is then as it was. Indexes all places anew.
  void load(const std::string& state);

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.pending_, self.window_, self.clouds_, self.known_ground_, self.memory_, self.sent_,
      self.counters_, self.place_at_m_, self.map_id_);
  }

 private:
  static constexpr std::size_t kMostPending = 64;
  std::optional<model::Keyframe> take_pending(std::uint64_t sequence);
  std::optional<Place> place_here(const model::MapUpdate& update);
  std::optional<model::LoopClosure> look_for(const Place& place);
  /// How sure a found place is.
  struct Verdict {
    bool is_sure = false;
    bool is_expected = false;  ///< The mapper's poses allow it.
    double log10_false_alarm = 0.0;
  };
  Verdict judge(const FoundPlace& best, const Place& from, const Place& place,
                std::size_t searched) const;

  LoopCloserParameters parameters_;
  bool wants_clouds_;
  std::deque<model::Keyframe> pending_;  ///< In order of time.
  PlaceWindow window_;
  PlaceClouds clouds_;
  KnownGround known_ground_;
  PlaceMemory memory_;
  PlaceSearch search_;
  SentClosures sent_;
  LoopCounters counters_;
  double place_at_m_ = 0.0;   ///< Path at which the next place is made.
  std::uint32_t map_id_ = 0;  ///< 0 before the first keyframe.
};

}  // namespace understory::loop_closer
