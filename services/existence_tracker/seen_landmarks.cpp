#include "services/existence_tracker/seen_landmarks.hpp"

#include <map>
#include <set>

namespace understory::existence_tracker {

std::vector<model::LandmarkId> seen_landmarks(const model::MapUpdate& update) {
  const std::map<model::LandmarkId, model::LandmarkId> merged(update.merged.begin(),
                                                              update.merged.end());
  std::vector<model::LandmarkId> ids;
  std::set<model::LandmarkId> known;
  for (const model::Association& pair : update.associations) {
    model::LandmarkId id = pair.landmark_id;
    std::size_t steps = 0;  // Bounded: merges in a message may form a circle.
    for (auto next = merged.find(id); next != merged.end() && steps <= merged.size();
         next = merged.find(id), ++steps)
      id = next->second;
    if (known.insert(id).second) ids.push_back(id);
  }
  return ids;
}

}  // namespace understory::existence_tracker
