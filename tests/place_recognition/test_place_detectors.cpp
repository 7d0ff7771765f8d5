// What every detector behind the interface must do.
#include "common/place_recognition/place_detector.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/hierarchy/geometric_hierarchy.hpp"
#include "common/place_recognition/detectors/hierarchy_detector.hpp"
#include "tests/catch.hpp"
#include "tests/place_recognition/place_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A database of frames of unlike places; ids 10, 20, ...
struct Places {
  std::mt19937_64 random;
  std::vector<PlaceFrame> frames;
  std::unique_ptr<PlaceDetector> detector;

  explicit Places(const std::string& name, std::uint64_t seed = 1, std::size_t count = 30)
      : random(seed), detector(make_detector(name)) {
    for (std::size_t i = 0; i < count; ++i) {
      frames.push_back(test::random_frame(random, 30));
      frames.back().id = static_cast<FrameId>(10 * (i + 1));
      if (wants_cloud(name)) frames.back().cloud = test::random_cloud(frames.back(), 0.02, random);
      detector->add(frames.back());
    }
  }
};

std::string any_detector() {
  return GENERATE(from_range(
      std::vector<std::string>({"range_histogram", "glare", "glarot", "glarot_3d", "scan_context",
                                "geometric_hierarchy", "constellation", "stems"})));
}

bool same_places(const std::vector<ScoredPlace>& a, const std::vector<ScoredPlace>& b,
                 double tolerance) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](const ScoredPlace& x, const ScoredPlace& y) {
                      return x.frame == y.frame && std::abs(x.score - y.score) <= tolerance;
                    });
}

}  // namespace

TEST_CASE("The factory knows the names and refuses others", "[detectors]") {
  CHECK(detector_names().size() == 8);
  for (const std::string& name : detector_names()) CHECK(make_detector(name)->size() == 0);
  CHECK_THROWS_WITH(make_detector("glar"),
                    Catch::Contains("\"glar\"") && Catch::Contains("glarot_3d"));
  CHECK_THROWS_AS(wants_cloud(""), std::invalid_argument);
}

TEST_CASE("Every detector finds a frame again that it has", "[detectors]") {
  const std::string name = any_detector();
  CAPTURE(name);
  Places places(name);
  CHECK(places.detector->size() == places.frames.size());
  CHECK(places.detector->descriptor_bytes() > 0);
  std::size_t found = 0;
  for (const PlaceFrame& frame : places.frames) {
    const auto best = places.detector->query(frame, {});
    REQUIRE(!best.empty());
    CHECK(best.size() <= PlaceQuery{}.most);
    CHECK(std::is_sorted(best.begin(), best.end(),
                         [](const auto& a, const auto& b) { return a.score > b.score; }));
    found += best.front().frame == frame.id ? 1 : 0;
    for (const ScoredPlace& place : best) CHECK(std::isfinite(place.score));
  }
  CHECK(found == places.frames.size());
}

TEST_CASE("No frame newer than asked for is found", "[detectors]") {
  const std::string name = any_detector();
  CAPTURE(name);
  Places places(name);
  for (std::size_t i = 0; i < places.frames.size(); i += 4) {
    const FrameId newest = places.frames[i].id - 1;
    for (const ScoredPlace& place : places.detector->query(places.frames[i], {newest, 100}))
      CHECK(place.frame <= newest);
  }
  CHECK(places.detector->query(places.frames[0], {9, 10}).empty());
}

TEST_CASE("The order of landmarks does not count, nor what was asked before", "[detectors]") {
  const std::string name = any_detector();
  CAPTURE(name);
  Places places(name);
  const PlaceFrame query = places.frames[7];
  const auto first = places.detector->query(query, {});
  PlaceFrame shuffled = query;
  std::shuffle(shuffled.landmarks.begin(), shuffled.landmarks.end(), places.random);
  std::shuffle(shuffled.cloud.begin(), shuffled.cloud.end(), places.random);
  const auto second = places.detector->query(shuffled, {});
  REQUIRE(!second.empty());
  CHECK(second.front().frame == first.front().frame);
  CHECK(std::abs(second.front().score - first.front().score) <
        1e-3 * std::abs(first.front().score) + 1e-5);
  CHECK(same_places(places.detector->query(query, {}), first, 0.0));
}

TEST_CASE("Frames that say nothing give nothing and harm nothing", "[detectors]") {
  const std::string name = any_detector();
  CAPTURE(name);
  Places places(name, 1, 10);
  PlaceFrame empty, one, broken, alike, far;
  one.landmarks.push_back({{1.0, 2.0, 0.0}, 0.3});
  broken.landmarks.assign(5, {{kNan, 1.0, 0.0}, 0.3});
  broken.cloud.assign(4, Eigen::Vector3f(std::numeric_limits<float>::infinity(), 0.0F, 0.0F));
  alike.landmarks.assign(4, {{3.0, 3.0, 0.0}, 0.2});
  far.landmarks.assign(3, {{1e30, 1e30, 1e30}, 0.2});
  FrameId id = 1000;
  for (PlaceFrame* frame : {&empty, &one, &broken, &alike, &far}) {
    frame->id = id++;
    places.detector->add(*frame);
    for (const ScoredPlace& place : places.detector->query(*frame, {}))
      CHECK(std::isfinite(place.score));
  }
  CHECK(places.detector->query(empty, {}).empty());
  CHECK(places.detector->query(broken, {}).empty());
  // The others are found as before.
  CHECK(places.detector->query(places.frames[3], {}).front().frame == places.frames[3].id);

  PlaceFrame partly = places.frames[3];
  partly.landmarks.push_back({{kNan, kNan, kNan}, kNan});
  CHECK(places.detector->query(partly, {}).front().frame == partly.id);
}

TEST_CASE("Those that do not depend on the heading find a turned frame", "[detectors]") {
  const std::string name = GENERATE(as<std::string>(), "range_histogram", "glarot", "scan_context",
                                    "geometric_hierarchy", "constellation", "stems");
  CAPTURE(name);
  Places places(name, 3);
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  std::size_t found = 0;
  for (const PlaceFrame& frame : places.frames) {
    const geometry::SE2 frame_T_query(0.0, 0.0, angle(places.random));
    const auto best = places.detector->query(test::seen_from(frame, frame_T_query), {});
    if (best.empty() || best.front().frame != frame.id) continue;
    ++found;
    // One of the guesses, if there are any, has the heading.
    double off = best.front().guesses.empty() ? 0.0 : 10.0;
    for (const auto& guess : best.front().guesses) {
      const double sigma = std::sqrt(guess.covariance(2, 2));
      off = std::min(
          off, std::abs(geometry::wrap_angle(guess.mean.theta() - frame_T_query.theta())) / sigma);
    }
    CHECK(off < 4.0);
  }
  CHECK(found >= places.frames.size() - 2);
}

TEST_CASE("The votes of polygons are those of all pairs of polygons", "[detectors]") {
  Places places("glare", 4, 12);
  HierarchyDetectorParameters parameters;
  detectors::HierarchyDetector detector(parameters, 0.1);
  for (const PlaceFrame& frame : places.frames) detector.add(frame);
  const auto polygons = [](const PlaceFrame& frame) {
    hierarchy::GeometricHierarchy built;
    std::uint64_t id = 0;
    for (const PlaceLandmark& landmark : frame.landmarks)
      built.insert(id++, landmark.position_m.head<2>());
    std::vector<hierarchy::Descriptor> descriptors;
    for (const hierarchy::Polygon& polygon : built.polygons()) {
      if (polygon.exists()) descriptors.push_back(polygon.descriptor);
    }
    return descriptors;
  };

  PlaceFrame query = places.frames[5];
  test::disturb(query, 0.05, places.random);
  const auto votes = detector.votes(query, places.frames.size());
  for (std::size_t i = 0; i < places.frames.size(); ++i) {
    double slow = 0.0;
    for (const hierarchy::Descriptor& mine : polygons(query)) {
      double best = 0.0;
      for (const hierarchy::Descriptor& other : polygons(places.frames[i])) {
        double squared = 0.0;
        for (std::size_t k = 0; k < mine.size(); ++k)
          squared += std::pow(static_cast<double>(mine[k]) - static_cast<double>(other[k]), 2);
        best = std::max(best, 1.0 - std::sqrt(squared) / parameters.max_descriptor_distance);
      }
      slow += best;
    }
    CHECK(std::abs(votes[i] - slow) < 1e-4 * (1.0 + slow));
  }
  CHECK(std::max_element(votes.begin(), votes.end()) - votes.begin() == 5);
}

TEST_CASE("Polygons and constellations give the relative pose", "[detectors]") {
  const std::string name =
      GENERATE(as<std::string>(), "geometric_hierarchy", "constellation", "stems");
  CAPTURE(name);
  Places places(name, 5);
  std::size_t near = 0;
  double nees = 0.0;
  const std::size_t queries = places.frames.size();
  for (const PlaceFrame& frame : places.frames) {
    const geometry::SE2 frame_T_query = test::random_motion(places.random, 2.0, 3.0);
    PlaceFrame query = test::seen_from(frame, frame_T_query);
    test::disturb(query, 0.03, places.random);
    const auto best = places.detector->query(query, {});
    if (best.empty() || best.front().frame != frame.id || best.front().guesses.empty()) continue;
    const auto& guess = best.front().guesses.front();
    const Eigen::Vector3d error = (guess.mean.inverse() * frame_T_query).Log();
    near += error.norm() < 0.2 ? 1 : 0;
    nees += error.dot(guess.covariance.ldlt().solve(error));
  }
  CHECK(near >= queries * 8 / 10);
  // Stated for worse landmarks than these: never too sure.
  CHECK(nees / static_cast<double>(near) < 4.0);
}
