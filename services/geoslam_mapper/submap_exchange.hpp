// Messages between mapper and store: submaps, queries and poses of submaps.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "services/geoslam_mapper/hand_over.hpp"
#include "services/geoslam_mapper/published_map.hpp"

namespace understory::geoslam_mapper {

/// Sends handed-over submaps until the store confirms them, and requests the submaps that the
/// mapper needs again.
class SubmapExchange {
 public:
  /// Messages after a keyframe.
  struct Messages {
    std::vector<model::Submap> submaps;  ///< To be published.
    std::vector<model::Submap>
        waited;  ///< Requested and not confirmed by the store yet: return these to the mapper.
    model::SubmapQuery query;  ///< To be published if it has ids.
  };
  /// After a keyframe: the submaps that the mapper handed over and those that it needs. `map_id`:
  /// of the map in use.
  Messages on_keyframe(model::Utime utime, std::vector<model::Submap> given_away,
                       const std::vector<model::SubmapId>& wanted, std::uint32_t map_id);
  /// The store confirms a submap.
  void on_stored(const model::SubmapStored& stored) { hand_over_.confirm(stored); }
  /// Whether a store keeps up: then the mapper may hand over more submaps.
  bool keeps_up() const { return hand_over_.may_hand_over(); }

  /// Whether the poses of submaps are to be compared now.
  bool is_correction_due(model::Utime now) const { return corrections_.is_due(now); }
  /// The message for MAP_CORRECTION, if a submap has moved or is new. `is_last`: at the end of the
  /// drive, by any distance.
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
