// Which observation is which track, at a known pose.
#include "services/associator/match.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

Track track_at(double x_m, double y_m) {
  Track track;
  track.position_m << x_m, y_m;
  track.detection_variance_m2 = 0.01;
  track.observations = 10;
  return track;
}

Observation observation_at(double x_m, double y_m) {
  Observation observation;
  observation.position_m << x_m, y_m;
  observation.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  return observation;
}

}  // namespace

TEST_CASE("Of pairs that are as likely the one with the lower indices is taken", "[associator]") {
  const std::vector<Track> twins(3, track_at(8.0, 1.0));
  const std::vector<Observation> observations(2, observation_at(8.1, 1.0));
  const std::vector<Match> matches = match(twins, observations, {}, {});
  REQUIRE(matches.size() == 2);
  for (std::uint32_t i = 0; i < 2; ++i) {
    CHECK(matches[i].observation == i);
    CHECK(matches[i].track == i);
    CHECK(matches[i].ambiguous);
  }
}

TEST_CASE("A swap that makes the scan likelier is made", "[associator]") {
  // Each alone prefers the first track; together they are at 0.15 m from theirs.
  const std::vector<Track> tracks{track_at(8.0, 0.0), track_at(8.0, 0.2)};
  const std::vector<Observation> observations{observation_at(8.0, 0.05),
                                              observation_at(8.0, -0.15)};
  const std::vector<Match> matches = match(tracks, observations, {}, {});
  REQUIRE(matches.size() == 2);
  CHECK(matches[0].track == 1);
  CHECK(matches[1].track == 0);
}
