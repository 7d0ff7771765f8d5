#include "services/existence_tracker/mapping_need.hpp"

#include <algorithm>

namespace understory::existence_tracker {
namespace {

/// A landmark counts as looked for when this number of keyframes expected it.
constexpr int kLooks = 3;

}  // namespace

void MappingNeed::know(std::size_t landmarks) {
  if (!has_map()) std::erase_if(seen_, [](const auto& entry) { return !entry.second.is_old; });
  known_ += landmarks;
}

bool MappingNeed::has_map() const {
  return known_ >= static_cast<std::uint64_t>(parameters_.min_landmarks);
}

void MappingNeed::look_for(model::LandmarkId id, bool is_hit, double probability, double along_m) {
  Looked& one = seen_.try_emplace(id, Looked{along_m, probability, 0, false, true}).first->second;
  one.along_m = along_m;
  ++one.looks;
  one.was_hit = one.was_hit || is_hit;
}

void MappingNeed::look_at_new(model::LandmarkId id, bool is_hit, double probability,
                              double along_m) {
  if (!is_hit && !seen_.contains(id)) return;
  Looked& one = seen_.try_emplace(id, Looked{along_m, probability, 0, true, false}).first->second;
  one.along_m = along_m;
  ++one.looks;
  if (!one.is_old) one.probability = probability;
}

void MappingNeed::drive_to(double along_m) {
  std::erase_if(seen_, [&](const auto& entry) {
    return entry.second.along_m < along_m - parameters_.window_m;
  });
}

double MappingNeed::missing_share(double recall) const {
  int looked_for = 0;
  double there = 0.0;
  double missed = 0.0;
  for (const auto& [id, one] : seen_) {
    if (!one.is_old || (!one.was_hit && one.looks < kLooks)) continue;
    ++looked_for;
    there += one.probability;
    if (!one.was_hit) missed += one.probability;
  }
  if (looked_for < parameters_.min_landmarks || there <= 0.0) return 0.0;
  return std::clamp(1.0 - (1.0 - missed / there) / std::max(0.05, recall), 0.0, 1.0);
}

bool MappingNeed::is_needed(double recall) const {
  return has_map() && missing_share(recall) + new_share() > parameters_.changed_above;
}

double MappingNeed::new_share() const {
  int seen = 0;
  double old = 0.0;
  double fresh = 0.0;
  for (const auto& [id, one] : seen_) {
    if (!one.was_hit) continue;
    ++seen;
    (one.is_old ? old : fresh) += one.is_old ? 1.0 : one.probability;
  }
  if (seen < parameters_.min_landmarks || old + fresh <= 0.0) return 0.0;
  return fresh / (old + fresh);
}

}  // namespace understory::existence_tracker
