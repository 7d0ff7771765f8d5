// The map as published: versions, and when MAP and MAP_DELTA are sent.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "services/geoslam_mapper/map_budget.hpp"

namespace understory::geoslam_mapper {

/// Numbers the versions of the map and decides when MAP is sent without a request: at once if
/// another map begins, soon after a start or a jump of the whole map, else within the budget. A
/// pure function of the keyframes and of the bytes sent.
class PublishedMap {
 public:
  /// Limits of the outputs; ranges and meanings: describe(MapperOutputParameters&).
  struct Limits {
    double moved_m = 0.001;
    double reset_distance_m = 0.5;
    double map_share = 0.1;
  };

  /// No map so far.
  explicit PublishedMap(const Limits& limits) : limits_(limits), budget_(limits.map_share) {}

  /// Number of the map; 0 before the first keyframe and without a given map.
  std::uint32_t map_id() const { return map_id_; }
  /// Stamp of the newest keyframe.
  model::Utime utime() const { return utime_; }
  /// Landmarks as a subscriber of every MAP_DELTA has them, in order of id.
  const std::vector<model::MapLandmark>& landmarks() const { return landmarks_; }
  /// Whether a keyframe began another map than the last one's.
  bool is_another(const model::MapUpdate& update) const {
    return map_id_ != 0 && map_id_ != update.map_id;
  }

  /// The mapper starts with these landmarks, in order of id and at least one.
  void begin_with(std::vector<model::MapLandmark> landmarks);
  /// Sets the covariances of landmarks of the present map.
  using SetCovariances = std::function<void(std::span<model::MapLandmark>)>;
  /// Adds the next keyframe; returns the change to publish, if any. `changed`: landmarks that are
  /// new, have moved or are around the vehicle, in order of id, without covariances. O(changed *
  /// log(map)).
  std::optional<model::MapDelta> on_update(const model::MapUpdate& update,
                                           const std::vector<model::MapLandmark>& changed,
                                           const SetCovariances& set_covariances);
  /// The mapper handed a submap over: it no longer changes, and subscribers keep it. O(map).
  void give_away(const model::Submap& submap);
  /// The mapper has loaded that submap again.
  void take_back(const model::Submap& submap) { keyframes_ += submap.keyframes.size(); }

  /// Adds bytes that were sent on other channels.
  void earn(std::size_t bytes) { budget_.earn(bytes); }
  /// Whether the map has changed since the last MAP.
  bool has_changed() const { return !is_sent_; }
  /// Whether MAP is to be sent now, without a request.
  bool is_due() const;
  /// A MAP of this size was sent without a request.
  void sent(std::size_t bytes);
  /// The message for MAP, from the mapper's landmarks and keyframes.
  model::WholeMap whole(std::vector<model::MapLandmark> landmarks,
                        std::vector<model::KeyframePose> keyframes) const;

  /// Members of a saved state; see common/state. The limits are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime_, self.version_, self.map_id_, self.landmarks_, self.budget_, self.is_sent_,
      self.must_send_, self.keyframes_);
  }

 private:
  Limits limits_;
  MapBudget budget_;
  model::Utime utime_ = 0;
  std::uint64_t version_ = 0;
  std::uint32_t map_id_ = 0;
  std::vector<model::MapLandmark> landmarks_;
  bool is_sent_ = true;
  bool must_send_ = false;  ///< It started or jumped since the last MAP.
  std::uint64_t keyframes_ = 0;
};

/// Size of a MAP with these numbers of landmarks and keyframes [bytes].
std::size_t map_bytes(std::size_t landmarks, std::size_t keyframes);

}  // namespace understory::geoslam_mapper
