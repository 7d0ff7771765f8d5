#include "services/geoslam_mapper/smoothing/gone_landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Addition to the gate's half width for deformations of the map since the landmark was seen [m].
constexpr double kBent_m = 0.1;

/// A landmark out of use, and its distance from the observation [m].
struct Nearest {
  model::LandmarkId id = 0;
  double distance_m = 0.0;
};

std::optional<Nearest> nearest_gone(const model::KeyframeLandmark& observed,
                                    const Eigen::Vector2d& position_m,
                                    const SmoothingMapperParameters& parameters,
                                    const LandmarkMap& landmarks) {
  std::optional<Nearest> best;
  const double variance = 0.5 * observed.covariance_m2.trace();
  const auto gate_m = [&](const StoredLandmark& landmark) {
    return parameters.gate_sigmas * std::sqrt(variance + landmark.local_variance()) +
           parameters.gate_floor_m + kBent_m;
  };
  const double reach_m = parameters.merge_distance_m + kBent_m;
  landmarks.unused_index().for_each_within(
      position_m, reach_m, [&](model::LandmarkId id, const Eigen::Vector2d&, double) {
        const StoredLandmark& landmark = landmarks.at(id);
        const double distance_m = (landmark.position_m - position_m).norm();
        if (landmark.kind != observed.kind || distance_m > gate_m(landmark)) return;
        if (!best || distance_m < best->distance_m) best = Nearest{id, distance_m};
      });
  return best;
}

}  // namespace

std::vector<model::Association> name_gone(const model::Keyframe& keyframe,
                                          const geometry::SE2& map_T_centre,
                                          std::span<const model::Association> known,
                                          const SmoothingMapperParameters& parameters,
                                          const LandmarkMap& landmarks) {
  if (landmarks.unused_index().size() == 0) return {};
  std::vector<bool> is_known(keyframe.landmarks.size(), false);
  for (const model::Association& pair : known) is_known[pair.keyframe_landmark] = true;

  // Of several observations near one landmark the nearest.
  std::map<model::LandmarkId, std::pair<double, std::uint32_t>> best;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (is_known[i]) continue;
    const model::KeyframeLandmark& observed = keyframe.landmarks[i];
    const auto found =
        nearest_gone(observed, map_T_centre * observed.position_m, parameters, landmarks);
    if (!found) continue;
    const auto [entry, is_new] = best.try_emplace(found->id, found->distance_m, i);
    if (!is_new && found->distance_m < entry->second.first) entry->second = {found->distance_m, i};
  }

  std::vector<model::Association> named;
  named.reserve(best.size());
  for (const auto& [id, one] : best) named.push_back({one.second, id});
  std::ranges::sort(named, {}, &model::Association::keyframe_landmark);
  return named;
}

}  // namespace understory::geoslam_mapper::smoothing
