#include "services/loop_closer/place_search.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/place_recognition/place_verifier.hpp"

namespace understory::loop_closer {
namespace {

constexpr const char* kNone = "none";

place_recognition::DetectorParameters detector_parameters(const StemParameters& stems) {
  place_recognition::DetectorParameters result;
  result.stems.noise.sigma_m = stems.sigma_m;
  result.stems.noise.matched_share = stems.matched_share;
  result.stems.noise.use_diameters = stems.use_diameters;
  result.stems.noise.diameter_log_sigma = stems.diameter_sigma;
  result.stems.triangles.triangles = stems.triangles;
  result.stems.most_frames = 60;
  result.stems.most_views = 20;
  result.constellation.sigma_m = stems.sigma_m / std::numbers::sqrt2;
  return result;
}

place_recognition::VerifierParameters verifier_parameters(const StemParameters& stems) {
  const place_recognition::DetectorParameters same = detector_parameters(stems);
  place_recognition::VerifierParameters result;
  result.sigma_m = stems.sigma_m;
  result.stems = same.stems.noise;
  result.triangles = same.stems.triangles;
  return result;
}

SearchParameters checked(const SearchParameters& search) {
  const std::string fault = fault_of(search);
  if (!fault.empty()) throw std::invalid_argument(fault);
  return search;
}

std::unique_ptr<PlaceVerification> verification_of(const SearchParameters& search,
                                                   const StemParameters& stems) {
  if (search.verifier == kNone) return nullptr;
  return std::make_unique<PlaceVerification>(
      search, place_recognition::gives_evidence(search.detector), verifier_parameters(stems));
}

}  // namespace

std::string fault_of(const SearchParameters& search) {
  try {
    const bool is_sure = place_recognition::gives_evidence(search.detector);
    if (search.verifier == kNone)
      return is_sure ? std::string()
                     : "search.verifier = \"none\": the score of detector \"" + search.detector +
                           "\" is no probability; correspondence_graph verifies it";
    // Throws if the name is unknown.
    (void)place_recognition::verifier_wants_cloud(search.verifier);
  } catch (const std::invalid_argument& error) {
    return std::string("search: ") + error.what();
  }
  return {};
}

bool wants_clouds(const SearchParameters& search) {
  return place_recognition::wants_cloud(search.detector) ||
         (search.verifier != kNone && place_recognition::verifier_wants_cloud(search.verifier));
}

PlaceSearch::PlaceSearch(const SearchParameters& search, const StemParameters& stems)
    : reach_m_(detector_parameters(stems).stems.max_distance_m),
      source_(search.verifier == kNone ? search.detector
                                       : search.detector + ", " + search.verifier),
      stem_noise_(detector_parameters(stems).stems.noise),
      detector_(
          place_recognition::make_detector(checked(search).detector, detector_parameters(stems))),
      verification_(verification_of(search, stems)) {}

void PlaceSearch::add(const Place& place) { detector_->add(frame_of(place)); }

std::vector<FoundPlace> PlaceSearch::find(const Place& place, std::uint64_t newest,
                                          const PlaceMemory& memory) const {
  const place_recognition::PlaceFrame query = frame_of(place);
  const std::size_t most = verification_ ? verification_->candidates() : 1;
  const auto scored =
      detector_->query(query, {static_cast<place_recognition::FrameId>(newest), most});
  if (verification_) return verification_->verified(query, scored, memory);

  std::vector<FoundPlace> found;
  found.reserve(scored.size());
  for (const place_recognition::ScoredPlace& one : scored) {
    found.push_back({static_cast<std::uint64_t>(one.frame), one.guesses.front(),
                     one.evidence->pairs, 0, one.evidence});
  }
  return found;
}

double PlaceSearch::poses_per_place() const {
  const double reach = reach_m_ / kPoseCellM;
  return std::numbers::pi * reach * reach * 2.0 * std::numbers::pi / kPoseCellRad;
}

}  // namespace understory::loop_closer
