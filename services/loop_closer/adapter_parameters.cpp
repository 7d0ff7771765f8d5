#include "services/loop_closer/adapter_parameters.hpp"

#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/place_verifier.hpp"

namespace understory::loop_closer {
namespace {

void describe(PlaceParameters& p, bus::ParameterTable& table) {
  table.add("places.every_m", p.every_m, {0.1, 1000.0}, "m",
            "Path from one place that is kept and looked for to the next.");
  table.add("places.window_m", p.window_m, {0.0, 200.0}, "m",
            "What was seen on so much path counts for a place.");
  table.add("places.merge_m", p.merge_m, {0.0, 5.0}, "m",
            "Detections of two keyframes nearer to each other are one stem, where the mapper does "
            "not say.");
  table.add("places.min_stems", p.min_stems, {3, 10000}, "",
            "A place with fewer stems is neither kept nor looked for.");
  table.add("places.most_stems", p.most_stems, {3, 10000}, "",
            "Of more stems the nearest count: what a search costs follows from it.");
  table.add("places.min_loop_m", p.min_loop_m, {1.0, 1e5}, "m",
            "Path that lies between two places of a loop at least. More than twice the sensor's "
            "range: what is still in view is no loop.");
  table.add("places.known_share", p.known_share, {0.0, 1.0}, "",
            "Share of a keyframe's landmarks that are of earlier passes with which the mapper is "
            "on known ground: nothing is kept, nothing looked for.");
  table.add("places.error_m", p.error_m, {0.0, 10.0}, "m",
            "Standard deviation per axis that the pose of a closure has beside what its stems "
            "show: the keyframes of a place lie to each other as the mapper has them.");
  table.add("places.error_rad", p.error_rad, {0.0, 1.0}, "rad", "The same of its heading.");
}

std::vector<std::string> verifiers() {
  std::vector<std::string> names{"none"};
  for (std::string& name : place_recognition::verifier_names()) names.push_back(std::move(name));
  return names;
}

void describe(SearchParameters& p, bus::ParameterTable& table) {
  table.add(
      "search.detector", p.detector, place_recognition::detector_names(),
      "Who finds places. stems: its score is a probability, set against what chance has; the "
      "others only name candidates and need a verifier. range_histogram and scan_context compare "
      "clouds: place_scan.period_s of landmark_extractor must not be 0.");
  table.add(
      "search.verifier", p.verifier, verifiers(),
      "Who compares a found place in detail, and gives the pose. none: only with stems. Where "
      "the detector is not stems the correspondence graph must agree with any other one. ICP and "
      "scan_context compare clouds, as above; they say yes or no, and the pose is the other's.");
  table.add("search.candidates", p.candidates, {1, 50}, "",
            "So many candidates, the most alike, are verified.");
  table.add("search.verified_pairs", p.verified_pairs, {3, 10000}, "",
            "Least number of landmarks in common that a verifier must find. A count does not say "
            "what chance gives: where stems stand denser, more.");
  table.add("search.verified_score", p.verified_score, {0.0, 1.0}, "",
            "The same of a verifier that compares clouds: for ICP the share of the points that "
            "have a partner, for scan_context one less the distance of two contexts.");
}

void describe(AcceptanceParameters& p, bus::ParameterTable& table) {
  table.add("accept.chance_decades", p.chance_decades, {0.0, 300.0}, "decades",
            "A found place outside of what the mapper's poses allow: so much less than one pose is "
            "expected to fit as well by chance, of all poses at all places.");
  table.add("accept.chance_decades_expected", p.chance_decades_expected, {0.0, 300.0}, "decades",
            "The same where the mapper's poses allow the place, of those poses that they allow.");
  table.add("accept.margin_decades", p.margin_decades, {0.0, 300.0}, "decades",
            "Likelihood of the found place over that of the next one that puts the vehicle "
            "elsewhere.");
  table.add("accept.min_pairs", p.min_pairs, {2, 10000}, "", "Least number of stems in common.");
  table.add("accept.gate_sigmas", p.gate_sigmas, {0.5, 100.0}, "sigma",
            "What the mapper's poses allow: so many standard deviations of both places.");
  table.add("accept.closed_m", p.closed_m, {0.0, 1e5}, "m",
            "Path after an accepted closure on which no other one is looked for.");
}

void describe(StemParameters& p, bus::ParameterTable& table) {
  table.add("stems.sigma_m", p.sigma_m, {0.001, 5.0}, "m",
            "Standard deviation of the difference of a stem's positions of two visits, per axis.");
  table.add("stems.matched_share", p.matched_share, {0.01, 0.99}, "",
            "Of the stems in view of both visits, those that both detect.");
  table.add("stems.use_diameters", p.use_diameters, "Compare the stems' diameters, too.");
  table.add(
      "stems.diameter_sigma", p.diameter_sigma, {0.001, 5.0}, "",
      "Standard deviation of the logarithm of the ratio of a stem's diameters of two visits.");
  table.add("stems.triangles", p.triangles, {10.0, 10000.0}, "",
            "Triangles of stems by which a place is found, about: 16 bytes each are kept.");
}

}  // namespace

void describe(LoopCloserParameters& parameters, bus::ParameterTable& table) {
  describe(parameters.places, table);
  describe(parameters.search, table);
  describe(parameters.accept, table);
  describe(parameters.stems, table);
}

}  // namespace understory::loop_closer
