#include "services/ekf/track_aliases.hpp"

#include <algorithm>

namespace understory::ekf {

std::optional<std::uint32_t> TrackAliases::landmark_of(const FilterState& state,
                                                       model::TrackId track) const {
  const auto alias = std::ranges::lower_bound(aliases_, track, {}, &Alias::track);
  if (alias == aliases_.end() || alias->track != track) return std::nullopt;
  const auto& landmarks = state.landmarks();
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].id == alias->landmark) return i;
  }
  return std::nullopt;
}

std::vector<Pairing> TrackAliases::known(const FilterState& state,
                                         std::span<const model::TrackId> tracks) const {
  std::vector<Pairing> known;
  for (std::uint32_t k = 0; k < tracks.size(); ++k) {
    if (const auto landmark = landmark_of(state, tracks[k])) known.push_back({k, *landmark});
  }
  return known;
}

void TrackAliases::set(model::TrackId track, model::TrackId landmark) {
  const auto alias = std::ranges::lower_bound(aliases_, track, {}, &Alias::track);
  if (alias != aliases_.end() && alias->track == track) {
    alias->landmark = landmark;
  } else {
    aliases_.insert(alias, {track, landmark});
  }
}

void TrackAliases::forget_landmark(model::TrackId landmark) {
  std::erase_if(aliases_, [&](const Alias& alias) { return alias.landmark == landmark; });
}

}  // namespace understory::ekf
