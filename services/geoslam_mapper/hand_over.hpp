// Transfer of submaps between the mapper and the store; a lost message loses no submap.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/submap.hpp"

namespace understory::geoslam_mapper {

/// Submaps that were handed over but are not confirmed by a store yet, and requests for submaps to
/// load again. Each is sent again every second of message time; confirmations and answers may
/// arrive twice.
class HandOver {
 public:
  /// At this number of unconfirmed submaps the hand-over stops.
  static constexpr std::size_t kMostWaiting = 64;

  /// Adds a submap that was handed over.
  void add(model::Submap submap) { waiting_.push_back({std::move(submap), kNever}); }
  /// The store confirms a submap; ignored unless its hash is that of the submap sent.
  void confirm(const model::SubmapStored& stored);
  /// Whether a store keeps up: fewer than kMostWaiting submaps are unconfirmed.
  bool may_hand_over() const { return waiting_.size() < kMostWaiting; }
  /// Number of submaps that no store has confirmed.
  std::size_t waiting() const { return waiting_.size(); }

  /// The submaps to send now.
  std::vector<model::Submap> due(model::Utime now);
  /// Removes a requested submap from the unconfirmed ones and returns it; the store may have it or
  /// not.
  std::optional<model::Submap> take(std::uint32_t map_id, model::SubmapId id);
  /// The requested submaps whose query is to be sent now.
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
  std::vector<Waiting> waiting_;                   ///< In the order of hand-over.
  std::map<model::SubmapId, model::Utime> asked_;  ///< Time of the last query per requested submap.
};

/// Decides when the poses of submaps are sent: MAP_CORRECTION carries the poses of all submaps.
class CorrectionWatch {
 public:
  /// Whether the poses are to be compared now.
  bool is_due(model::Utime now) const;
  /// The message, if a pose is new or has moved since the last message; `is_last`: by any distance,
  /// else by more than 0.05 m.
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
