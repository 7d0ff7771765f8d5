// Searches for places of the drive that the vehicle revisits.
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

/// Counts since the first start (a saved state includes them).
struct LoopCounters {
  std::uint64_t keyframes = 0;          ///< Localised by the mapper.
  std::uint64_t keyframes_missing = 0;  ///< Updates whose keyframe did not arrive.
  std::uint64_t places = 0;             ///< Stored.
  std::uint64_t without_cloud = 0;      ///< Places skipped: the method needs clouds, none arrived.
  std::uint64_t queries = 0;            ///< Places searched for.
  std::uint64_t sent = 0;               ///< Closures.
  std::uint64_t unexpected = 0;         ///< Of these, outside the mapper's expectation.
  std::uint64_t accepted = 0;           ///< By the mapper at once.
  std::uint64_t waiting = 0;            ///< At the mapper, for others that agree.
  std::uint64_t refused = 0;            ///< By the mapper.
  std::uint64_t revoked = 0;            ///< By any process or person.
  std::uint64_t other_map = 0;          ///< Places found in an earlier map.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.keyframes, s.keyframes_missing, s.places, s.without_cloud, s.queries, s.sent, s.unexpected,
      s.accepted, s.waiting, s.refused, s.revoked, s.other_map);
  }
};

/// The stage. Every few metres the stems seen on the last metres become a place. It is searched for
/// among all earlier places of the drive beyond a least path length, unless the mapper already
/// localises on known ground; a certain match is sent to the mapper as a loop closure (thesis 002
/// §2.4, §6.3). The mapper decides about acceptance: see its smoothing/closures.hpp.
class LoopCloser {
 public:
  /// Without places.
  explicit LoopCloser(const LoopCloserParameters& parameters);

  /// A keyframe; its update must come later. At most kMostPending wait.
  void add(const model::Keyframe& keyframe);
  /// A cloud of one of its scans; the keyframe's update must come later. Ignored if no method
  /// compares clouds.
  void add(const model::PlaceScan& scan);
  /// The mapper's result for a keyframe. Returns the loop closure found, if any. Cost: one search
  /// every `every_m` metres.
  std::optional<model::LoopClosure> add(const model::MapUpdate& update);
  /// A part of the map that the mapper has handed over: closures now refer to its keyframes by
  /// their submap.
  void add(const model::Submap& submap) { memory_.follow(submap); }
  /// The mapper's result for a closure; false if the closure is not ours.
  bool add(const model::LoopResult& result);

  /// Counts for HEALTH and tests.
  const LoopCounters& counters() const { return counters_; }
  /// The stored places.
  const PlaceMemory& memory() const { return memory_; }

  /// The whole state, for a restart. O(places).
  std::string save() const;
  /// Continues from a saved state with the same output. Throws std::invalid_argument on other
  /// bytes; the state is then unchanged. Indexes all places anew.
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
  /// Certainty of a found place.
  struct Verdict {
    bool is_sure = false;
    bool is_expected = false;  ///< It is within the mapper's expectation.
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
  double place_at_m_ = 0.0;   ///< Path length at which the next place is made.
  std::uint32_t map_id_ = 0;  ///< 0 before the first keyframe.
};

}  // namespace understory::loop_closer
