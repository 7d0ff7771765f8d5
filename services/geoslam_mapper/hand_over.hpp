// The way of submaps between the mapper and the store: nothing is lost where messages are.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/submap.hpp"

namespace understory::geoslam_mapper {

/// Submaps that the mapper gave away and that no store has confirmed yet, and questions for those
/// that it wants back. Each is sent again every second of message time; a confirmation or an answer
/// may come twice.
class HandOver {
 public:
  /// With so many unconfirmed ones nothing more is given away.
  static constexpr std::size_t kMostWaiting = 64;

  /// A submap that was given away.
  void add(model::Submap submap) { waiting_.push_back({std::move(submap), kNever}); }
  /// The store has it, where the hash is that of what it was given.
  void confirm(const model::SubmapStored& stored);
  /// Whether a store keeps up: few wait.
  bool may_hand_over() const { return waiting_.size() < kMostWaiting; }
  /// Number of submaps that no store has confirmed.
  std::size_t waiting() const { return waiting_.size(); }

  /// The submaps to send now.
  std::vector<model::Submap> due(model::Utime now);
  /// Takes a wanted submap out of those that wait; the store may have it or not.
  std::optional<model::Submap> take(std::uint32_t map_id, model::SubmapId id);
  /// Those of the wanted ones to ask for now.
  std::vector<model::SubmapId> to_ask(std::span<const model::SubmapId> wanted, model::Utime now);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.asked_);
  }

 private:
  static constexpr model::Utime kNever = -1;
  struct Waiting {
    model::Submap submap;
    model::Utime sent = kNever;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.submap, s.sent);
    }
  };
  std::vector<Waiting> waiting_;                   ///< In the order in which they were given away.
  std::map<model::SubmapId, model::Utime> asked_;  ///< When, of those that are wanted.
};

/// When the poses of submaps are sent again: MAP_CORRECTION is their whole state.
class CorrectionWatch {
 public:
  /// Whether it is time to look at them.
  bool is_due(model::Utime now) const;
  /// The message, where a pose has moved or is new since the last one; `is_last`: by any distance,
  /// else by what matters to who reads the map.
  std::optional<model::MapCorrection> next(model::Utime now, std::uint32_t map_id,
                                           std::vector<model::SubmapPose> poses, bool is_last);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.looked_, self.version_, self.map_id_, self.sent_);
  }

 private:
  model::Utime looked_ = 0;
  std::uint64_t version_ = 0;
  std::uint32_t map_id_ = 0;
  std::vector<model::SubmapPose> sent_;
};

}  // namespace understory::geoslam_mapper
