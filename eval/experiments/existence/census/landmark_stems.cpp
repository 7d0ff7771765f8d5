#include "eval/experiments/existence/census/landmark_stems.hpp"

#include <algorithm>
#include <utility>

namespace understory::eval::experiments::existence::census {

void LandmarkStems::add(model::Utime utime, std::vector<std::uint32_t> stems) {
  scans_[utime] = std::move(stems);
}

void LandmarkStems::count(const model::MapUpdate& update) {
  for (const model::IdentifiedDetection& one : update.detections) {
    if (one.landmark_id == 0 || one.scan >= update.scans.size()) continue;
    const auto scan = scans_.find(update.scans[one.scan].utime);
    if (scan == scans_.end() || one.detection >= scan->second.size()) continue;
    ++counts_[one.landmark_id][scan->second[one.detection]];
  }
  for (const auto& [old_id, new_id] : update.merged) {
    const auto found = counts_.find(old_id);
    if (found == counts_.end()) continue;
    const std::map<std::uint32_t, int> merged = std::move(found->second);
    counts_.erase(found);
    for (const auto& [stem, count] : merged) counts_[new_id][stem] += count;
  }
}

std::optional<std::uint32_t> LandmarkStems::of(model::LandmarkId id) const {
  const auto found = counts_.find(id);
  if (found == counts_.end() || found->second.empty()) return std::nullopt;
  return std::ranges::max_element(found->second, {}, [](const auto& one) { return one.second; })
      ->first;
}

}  // namespace understory::eval::experiments::existence::census
