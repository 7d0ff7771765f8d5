// Detector and verifier by name, as the configuration chooses them.
#include <fmt/format.h>

#include "common/bus/memory_bus.hpp"
#include "common/place_recognition/stem_recogniser.hpp"
#include "services/loop_closer/adapter.hpp"
#include "services/loop_closer/loop_closer.hpp"
#include "services/loop_closer/place_search.hpp"
#include "tests/catch.hpp"
#include "tests/loop_closer/chosen_search.hpp"

using namespace understory;
using namespace understory::loop_closer;
using Catch::Matchers::Contains;
using test::chosen;
using test::count;
using test::Found;
using test::ReckoningMapper;
using test::ring;
using test::RingDrive;
using test::RingOptions;

TEST_CASE("The default is the recogniser of stems, to the bit", "[loop_closer]") {
  LoopCloserParameters parameters = chosen("stems", "none");
  CHECK(LoopCloserParameters().search.detector == "stems");
  CHECK(LoopCloserParameters().search.verifier == "none");
  const PlaceSearch search(parameters.search, parameters.stems);
  CHECK(search.source() == "stems");

  const RingDrive drive(ring(71, 1.4));
  PlaceSearch filled(parameters.search, parameters.stems);
  place_recognition::StemRecogniserParameters same;
  same.noise.sigma_m = parameters.stems.sigma_m;
  same.noise.matched_share = parameters.stems.matched_share;
  same.noise.use_diameters = false;
  same.noise.diameter_log_sigma = parameters.stems.diameter_sigma;
  same.triangles.triangles = parameters.stems.triangles;
  same.most_frames = 200;
  same.most_views = 20;
  place_recognition::StemRecogniser recogniser(same);

  std::size_t compared = 0;
  for (std::size_t k = 0; k < drive.size(); k += 2) {
    Place place;
    place.keyframe = k;
    for (const model::KeyframeLandmark& one : drive.keyframe_at(k).landmarks)
      place.stems.push_back({one.position_m, 0.0});
    if (k > 40) {
      const auto newest = static_cast<place_recognition::FrameId>(k - 40);
      const auto answer = recogniser.query(place.stems, newest);
      const auto found = filled.find(place, k - 40, {});
      REQUIRE(found.empty() == (answer.best() == nullptr));
      if (!found.empty()) {
        ++compared;
        CHECK(found[0].keyframe == static_cast<std::uint64_t>(answer.best()->frame));
        CHECK(found[0].place_T_query.mean.coordinates() ==
              answer.best()->frame_T_query.coordinates());
        CHECK(found[0].place_T_query.covariance == answer.best()->covariance);
        CHECK(found[0].evidence->log_ratio == answer.best()->log_ratio);
        CHECK(found[0].evidence->margin_decades == answer.log10_margin);
        CHECK(found[0].pairs == answer.best()->pairs.size());
      }
    }
    filled.add(place);
    recogniser.add(static_cast<place_recognition::FrameId>(k), place.stems);
  }
  CHECK(compared > 20);
}

TEST_CASE("Every detector and verifier for landmarks closes loops, and no wrong ones",
          "[loop_closer]") {
  const std::vector<std::pair<std::string, std::string>> choices{
      {"glare", "correspondence_graph"},
      {"glarot", "correspondence_graph"},
      {"glarot_3d", "correspondence_graph"},
      {"geometric_hierarchy", "correspondence_graph"},
      {"constellation", "correspondence_graph"},
      {"stems", "correspondence_graph"},
      {"constellation", "hough"},
      {"constellation", "stem_likelihood"},
      {"stems", "hough"},
      {"stems", "stem_likelihood"}};
  for (const auto& [detector, verifier] : choices) {
    Found found;
    for (std::uint64_t seed = 81; seed <= 84; ++seed)
      count(RingDrive(ring(seed, 1.5)), chosen(detector, verifier), found);
    CAPTURE(detector, verifier);
    WARN(fmt::format("{} and {}: {} of {} queries sent, {} wrong", detector, verifier, found.sent,
                     found.queries, found.wrong));
    CHECK(found.wrong == 0);
    CHECK(found.sent > 0);
  }
}

TEST_CASE("Where nothing is seen again no detector closes anything", "[loop_closer]") {
  for (const std::string detector : {"glare", "glarot", "geometric_hierarchy", "constellation"}) {
    Found found;
    for (std::uint64_t seed = 91; seed <= 94; ++seed) {
      RingOptions options = ring(seed, 0.9);
      options.radius_m = 80.0;
      count(RingDrive(options), chosen(detector, "correspondence_graph"), found);
    }
    CAPTURE(detector, found.queries);
    CHECK(found.queries > 20);
    CHECK(found.sent == 0);
  }
}

TEST_CASE("A restarted loop closer of another choice gives the same bytes", "[loop_closer]") {
  const RingDrive drive(ring(85, 1.5));
  CHECK(test::same_after_restarts(drive, chosen("glarot", "correspondence_graph")) > 0);
}

TEST_CASE("A closure tells who found it, and that nobody knows its chance", "[loop_closer]") {
  const RingDrive drive(ring(81, 1.5));
  LoopCloser closer(chosen("constellation", "correspondence_graph"));
  ReckoningMapper mapper(drive);
  std::size_t sent = 0;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    closer.add(drive.keyframe_at(k));
    if (const auto closure = closer.add(mapper.update(k))) {
      ++sent;
      CHECK(closure->source == "constellation, correspondence_graph");
      CHECK(closure->log10_false_alarm == 0.0);
    }
  }
  CHECK(sent > 0);
}

TEST_CASE("A choice that cannot work is refused, with its key", "[loop_closer][service]") {
  const auto refused = [](const std::string& toml) -> std::string {
    bus::MemoryBus bus;
    try {
      bus::HostedService(loop_closer_service(), bus, bus::no_clock(), toml, "loop_closer.toml");
    } catch (const bus::ConfigurationError& error) {
      return error.what();
    }
    return "";
  };
  CHECK(refused("[search]\ndetector = \"stems\"\n").empty());
  CHECK(refused("[search]\ndetector = \"glarot\"\nverifier = \"correspondence_graph\"\n").empty());
  CHECK_THAT(refused("[search]\ndetector = \"glarot\"\n"),
             Contains("search.verifier") && Contains("no probability"));
  for (const std::string detector : {"scan_context", "range_histogram"}) {
    CHECK_THAT(refused("[search]\ndetector = \"" + detector + "\"\n"),
               Contains("search.verifier") && Contains("no probability"));
    CHECK(refused("[search]\ndetector = \"" + detector + "\"\nverifier = \"hough\"\n").empty());
  }
  for (const std::string verifier : {"generalised_icp", "scan_context"})
    CHECK(refused("[search]\nverifier = \"" + verifier + "\"\n").empty());
  CHECK_THAT(refused("[search]\nverifier = \"bow\"\n"), Contains("search.verifier"));
  CHECK_THAT(refused("[search]\ndetector = \"bow\"\n"), Contains("search.detector"));
  CHECK_THROWS_AS(PlaceSearch({.detector = "glare"}, {}), std::invalid_argument);
}
