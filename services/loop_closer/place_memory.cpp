#include "services/loop_closer/place_memory.hpp"

#include <algorithm>

namespace understory::loop_closer {

void PlaceMemory::follow(const model::Submap& submap) {
  for (const model::KeyframePose& pose : submap.keyframes) {
    const auto place =
        std::ranges::lower_bound(places_, pose.keyframe_sequence, {}, &Place::keyframe);
    if (place == places_.end() || place->keyframe != pose.keyframe_sequence) continue;
    if (place->map_id != submap.map_id) continue;
    place->in_submap = InSubmap{submap.id, {pose.map_T_vehicle, pose.covariance}};
  }
}

const Place* PlaceMemory::of_keyframe(std::uint64_t keyframe) const {
  const auto place = std::ranges::lower_bound(places_, keyframe, {}, &Place::keyframe);
  return place != places_.end() && place->keyframe == keyframe ? &*place : nullptr;
}

std::size_t PlaceMemory::count_until(double along_m) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(places_, along_m, {}, &Place::along_m) -
                                  places_.begin());
}

}  // namespace understory::loop_closer
