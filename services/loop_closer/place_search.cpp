#include "services/loop_closer/place_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::loop_closer {
namespace {

place_recognition::StemRecogniserParameters recogniser_parameters(const StemParameters& stems) {
  place_recognition::StemRecogniserParameters result;
  result.noise.sigma_m = stems.sigma_m;
  result.noise.matched_share = stems.matched_share;
  result.noise.use_diameters = stems.use_diameters;
  result.noise.diameter_log_sigma = stems.diameter_sigma;
  result.triangles.triangles = stems.triangles;
  result.most_frames = 200;
  result.most_views = 20;
  return result;
}

}  // namespace

PlaceSearch::PlaceSearch(const StemParameters& parameters)
    : parameters_(recogniser_parameters(parameters)), recogniser_(parameters_) {}

void PlaceSearch::add(const Place& place) {
  recogniser_.add(static_cast<place_recognition::FrameId>(place.keyframe), place.stems);
}

SearchAnswer PlaceSearch::find(std::span<const LevelStem> stems, std::uint64_t newest) const {
  const place_recognition::PlaceAnswer answer =
      recogniser_.query(stems, static_cast<place_recognition::FrameId>(newest));
  SearchAnswer result;
  result.margin_decades = answer.log10_margin;
  for (const place_recognition::PlaceCandidate& one : answer.candidates) {
    result.found.push_back({static_cast<std::uint64_t>(one.frame),
                            {one.frame_T_query, one.covariance},
                            one.log_ratio,
                            one.pairs.size()});
  }
  if (!result.found.empty()) std::swap(result.found.front(), result.found[answer.nearest]);
  return result;
}

double PlaceSearch::poses_per_place() const {
  const double reach = parameters_.max_distance_m / kPoseCellM;
  return std::numbers::pi * reach * reach * 2.0 * std::numbers::pi / kPoseCellRad;
}

}  // namespace understory::loop_closer
