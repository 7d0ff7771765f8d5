// Submaps between mapper and store, and where they are: the messages of both
// directions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/geoslam_mapper/hand_over.hpp"
#include "services/geoslam_mapper/mapper_method.hpp"
#include "services/geoslam_mapper/published_map.hpp"

namespace understory::geoslam_mapper {

/// Gives the store what the mapper gives away until the store has it, and asks
/// for what the mapper wants back.
class SubmapExchange {
 public:
  /// What follows from a keyframe.
  struct Messages {
    std::vector<model::Submap> submaps;  ///< To be published.
    std::vector<std::string> refused;    ///< Why the mapper did not take back what waited.
    model::SubmapQuery query;            ///< To be published where it has ids.
  };
  /// After a keyframe. The mapper may give away more as long as a store keeps
  /// up.
  Messages on_keyframe(model::Utime utime, MapperMethod& mapper, PublishedMap& map);
  /// The store has a submap.
  void on_stored(const model::SubmapStored& stored, MapperMethod& mapper);
  /// The answer to a query; it may come twice: then the submap is not away any
  /// more. Returns why the mapper does not take it; empty where it does, or
  /// does not want it.
  std::string on_reply(const model::Submap& submap, MapperMethod& mapper, PublishedMap& map) const;
  /// Whether a store keeps up.
  bool keeps_up() const { return hand_over_.may_hand_over(); }

  /// The message for MAP_CORRECTION, where it is time and a submap has moved or
  /// is new. `is_last`: at the end of the drive, by any distance.
  std::optional<model::MapCorrection> correction(const MapperMethod& mapper,
                                                 const PublishedMap& map, model::Utime now,
                                                 bool is_last);

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
