// Submaps between mapper and store, and where they are: the messages of both
// directions.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "services/geoslam_mapper/hand_over.hpp"
#include "services/geoslam_mapper/published_map.hpp"

namespace understory::geoslam_mapper {

/// Gives the store what the mapper gives away until the store has it, and asks
/// for what the mapper wants back.
class SubmapExchange {
 public:
  /// What follows from a keyframe.
  struct Messages {
    std::vector<model::Submap> submaps;  ///< To be published.
    std::vector<model::Submap> waited;   ///< Wanted, and not yet with the store: for the mapper.
    model::SubmapQuery query;            ///< To be published where it has ids.
  };
  /// After a keyframe: what the mapper gave away with it, and what it wants
  /// back. `map_id`: of the map in use.
  Messages on_keyframe(model::Utime utime, std::vector<model::Submap> given_away,
                       const std::vector<model::SubmapId>& wanted, std::uint32_t map_id);
  /// The store has a submap.
  void on_stored(const model::SubmapStored& stored) { hand_over_.confirm(stored); }
  /// Whether a store keeps up: as long as it does, the mapper may give away
  /// more.
  bool keeps_up() const { return hand_over_.may_hand_over(); }

  /// Whether it is time to look where the submaps are.
  bool is_correction_due(model::Utime now) const { return corrections_.is_due(now); }
  /// The message for MAP_CORRECTION, where a submap has moved or is new.
  /// `is_last`: at the end of the drive, by any distance.
  std::optional<model::MapCorrection> correction(std::vector<model::SubmapPose> poses,
                                                 const PublishedMap& map, bool is_last) {
    return corrections_.next(map.utime(), map.map_id(), std::move(poses), is_last);
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.hand_over_, self.corrections_);
  }

 private:
  HandOver hand_over_;
  CorrectionWatch corrections_;
};

}  // namespace understory::geoslam_mapper
