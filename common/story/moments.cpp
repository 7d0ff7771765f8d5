#include "common/story/moments.hpp"

namespace understory::story {

std::uint32_t Moments::add(const model::MapUpdate& update) {
  moments_.push({update.utime, update.keyframe_sequence, update.map_T_vehicle.translation(),
                 ++placed_, update.status});
  return latest();
}

std::uint32_t Moments::at(model::Utime utime) {
  constexpr std::size_t kLookedAt = 64;
  const std::size_t size = moments_.size();
  for (std::size_t back = 1; back <= std::min(size, kLookedAt); ++back) {
    if (moments_[size - back].utime == utime)
      return latest() - static_cast<std::uint32_t>(back - 1);
  }
  Moment moment;
  moment.utime = utime;
  moments_.push(moment);
  return latest();
}

const Moment* Moments::find(std::uint32_t number) const {
  if (number < moments_.dropped() || number >= moments_.heard()) return nullptr;
  return &moments_[number - moments_.dropped()];
}

}  // namespace understory::story
