#include "services/loop_closer/adapter_parameters.hpp"

#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/place_verifier.hpp"

namespace understory::loop_closer {
namespace {

void describe(PlaceParameters& p, bus::ParameterTable& table) {
  table.add("places.every_m", p.every_m, {0.1, 1000.0}, "m",
            "Path length between places; each is kept and searched for.");
  table.add("places.window_m", p.window_m, {0.0, 200.0}, "m",
            "Path length whose detections belong to a place.");
  table.add("places.merge_m", p.merge_m, {0.0, 5.0}, "m",
            "Detections of two keyframes nearer to each other are one stem, if the mapper gives no "
            "association.");
  table.add("places.min_stems", p.min_stems, {3, 10000}, "",
            "A place with fewer stems is neither kept nor searched for.");
  table.add("places.most_stems", p.most_stems, {3, 10000}, "",
            "Most stems of a place, the nearest; bounds the cost of a search.");
  table.add("places.min_loop_m", p.min_loop_m, {1.0, 1e5}, "m",
            "Least path length between two places of a loop. More than twice the sensor's range: "
            "landmarks still in view are no loop.");
  table.add("places.known_share", p.known_share, {0.0, 1.0}, "",
            "With this share of landmarks from earlier passes a keyframe is on known ground: no "
            "place is kept or searched for.");
  table.add("places.error_m", p.error_m, {0.0, 10.0}, "m",
            "Standard deviation per axis of a closure's pose, in addition to that from its stems: "
            "relative poses of a place's keyframes are the mapper's.");
  table.add("places.error_rad", p.error_rad, {0.0, 1.0}, "rad", "The same for its heading.");
}

std::vector<std::string> verifiers() {
  std::vector<std::string> names{"none"};
  for (std::string& name : place_recognition::verifier_names()) names.push_back(std::move(name));
  return names;
}

void describe(SearchParameters& p, bus::ParameterTable& table) {
  table.add(
      "search.detector", p.detector, place_recognition::detector_names(),
      "Method that finds places. stems: its score is a probability against a match by chance; the "
      "others only give candidates and need a verifier. range_histogram and scan_context compare "
      "clouds: place_scan.period_s of landmark_extractor must not be 0.");
  table.add("search.verifier", p.verifier, verifiers(),
            "Method that verifies a found place and gives the pose. none: only with stems. If the "
            "detector is not stems, the correspondence graph must agree with any other verifier. "
            "ICP and scan_context compare clouds, as above; they only accept or reject, and the "
            "pose is the other method's.");
  table.add("search.candidates", p.candidates, {1, 50}, "",
            "Number of best candidates that are verified.");
  table.add("search.verified_pairs", p.verified_pairs, {3, 10000}, "",
            "Least number of common landmarks for a verifier. The number by chance is higher where "
            "stems are denser: use more there.");
  table.add("search.verified_score", p.verified_score, {0.0, 1.0}, "",
            "The same for a verifier that compares clouds: for ICP the share of points with a "
            "partner, for scan_context 1 - distance of two contexts.");
}

void describe(AcceptanceParameters& p, bus::ParameterTable& table) {
  table.add("accept.chance_decades", p.chance_decades, {0.0, 300.0}, "decades",
            "For a place outside of the gate of the mapper's poses: least -log10 of the number of "
            "poses, of all at all places, that are expected to fit as well by chance.");
  table.add("accept.chance_decades_expected", p.chance_decades_expected, {0.0, 300.0}, "decades",
            "The same for a place inside of the gate, counting the poses inside of it.");
  table.add(
      "accept.margin_decades", p.margin_decades, {0.0, 300.0}, "decades",
      "log10 of the likelihood of the found place over that of the next best pose elsewhere.");
  table.add("accept.min_pairs", p.min_pairs, {2, 10000}, "", "Least number of common stems.");
  table.add("accept.gate_sigmas", p.gate_sigmas, {0.5, 100.0}, "sigma",
            "Gate of the mapper's poses, in standard deviations of both places.");
  table.add("accept.closed_m", p.closed_m, {0.0, 1e5}, "m",
            "Path length after an accepted closure without a search.");
}

void describe(StemParameters& p, bus::ParameterTable& table) {
  table.add("stems.sigma_m", p.sigma_m, {0.001, 5.0}, "m",
            "Standard deviation of the difference of a stem's positions in two visits, per axis.");
  table.add("stems.matched_share", p.matched_share, {0.01, 0.99}, "",
            "Share of the stems in view of both visits that both detect.");
  table.add("stems.use_diameters", p.use_diameters, "Compare the stems' diameters, too.");
  table.add(
      "stems.diameter_sigma", p.diameter_sigma, {0.001, 5.0}, "",
      "Standard deviation of the logarithm of the ratio of a stem's diameters in two visits.");
  table.add("stems.triangles", p.triangles, {10.0, 10000.0}, "",
            "Approximate number of stem triangles that describe a place, 16 bytes each.");
}

}  // namespace

void describe(LoopCloserParameters& parameters, bus::ParameterTable& table) {
  describe(parameters.places, table);
  describe(parameters.search, table);
  describe(parameters.accept, table);
  describe(parameters.stems, table);
}

}  // namespace understory::loop_closer
