#include "services/existence_tracker/mapping_need.hpp"

#include <algorithm>

namespace understory::existence_tracker {
namespace {

/// A landmark was looked for when so many keyframes expected it.
constexpr int kLooks = 3;

}  // namespace

void MappingNeed::look(model::LandmarkId id, bool is_hit, bool is_old, double along_m) {
  Looked& one = seen_.try_emplace(id, Looked{along_m, 0, false, is_old}).first->second;
  one.along_m = along_m;
  ++one.looks;
  one.was_hit = one.was_hit || is_hit;
}

void MappingNeed::drive_to(double along_m) {
  std::erase_if(seen_, [&](const auto& entry) {
    return entry.second.along_m < along_m - parameters_.window_m;
  });
}

double MappingNeed::missing_share(double recall) const {
  int looked_for = 0;
  int missed = 0;
  for (const auto& [id, one] : seen_) {
    if (!one.is_old || (!one.was_hit && one.looks < kLooks)) continue;
    ++looked_for;
    if (!one.was_hit) ++missed;
  }
  if (looked_for < parameters_.min_landmarks) return 0.0;
  const double share = static_cast<double>(missed) / looked_for;
  return std::clamp(1.0 - (1.0 - share) / std::max(0.05, recall), 0.0, 1.0);
}

double MappingNeed::new_share() const {
  int seen = 0;
  int fresh = 0;
  for (const auto& [id, one] : seen_) {
    if (!one.was_hit) continue;
    ++seen;
    if (!one.is_old) ++fresh;
  }
  if (seen < parameters_.min_landmarks) return 0.0;
  return static_cast<double>(fresh) / seen;
}

}  // namespace understory::existence_tracker
