#include "services/ekf/compatible_update.hpp"

#include <algorithm>

namespace understory::ekf {
namespace {

/// Each round removes one pairing plus 1/20 of them, so a scan that contradicts the map ends soon.
constexpr std::size_t kPartRemoved = 20;

}  // namespace

CompatibleUpdate update_compatible(FilterState& state, std::span<const Observation> observations,
                                   std::vector<Pairing>& pairings,
                                   std::span<const double> set_gates, UpdateScratch& scratch) {
  CompatibleUpdate result;
  if (pairings.empty()) return result;
  scratch.backup.take(state);
  const auto is_better = [&](const Pairing& a, const Pairing& b) {
    return squared_distance(state, a.landmark, observations[a.observation]) <
           squared_distance(state, b.landmark, observations[b.observation]);
  };

  while (!pairings.empty()) {
    const double distance = scratch.joint.apply(state, observations, pairings, scratch.low_rank);
    if (distance >= 0.0 && distance <= set_gates[pairings.size()]) {
      scratch.joint.finish(state, scratch.low_rank);
      result.distance = distance;
      break;
    }
    scratch.backup.restore(state);

    const std::size_t drop = 1 + pairings.size() / kPartRemoved;
    for (std::size_t k = 0; k < drop && !pairings.empty(); ++k) {
      const auto worst = std::max_element(pairings.begin(), pairings.end(), is_better);
      ++state.landmark(worst->landmark).refused;
      ++result.removed;
      pairings.erase(worst);
    }
  }
  return result;
}

}  // namespace understory::ekf
