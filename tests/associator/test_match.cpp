// Which observation is which track, at a known pose.
#include "services/associator/match.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

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

/// Covariance of the difference of the two, at a pose that is known exactly.
Eigen::Matrix2d spread(const Track& track, const Observation& observation) {
  constexpr double kFloor_m = 0.03;
  const double sigmas = AssociatorParameters{}.gate_sigmas;
  return observation.covariance_m2 +
         (track.variance_m2() + kFloor_m * kFloor_m / (sigmas * sigmas)) *
             Eigen::Matrix2d::Identity();
}

double log_spread(const Track& track, const Observation& observation) {
  return std::log(spread(track, observation).determinant());
}

/// Minus twice the log likelihood of the pair, up to a constant; infinite outside of the gate.
double cost(const Track& track, const Observation& observation) {
  const Eigen::Vector2d error = track.position_m - observation.position_m;
  const double squared = error.dot(spread(track, observation).inverse() * error);
  if (std::sqrt(squared) > AssociatorParameters{}.gate_sigmas)
    return std::numeric_limits<double>::infinity();
  return squared + log_spread(track, observation);
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

TEST_CASE("An observation goes to the track by which it is likeliest", "[associator]") {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int wider_and_taken = 0;
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<Track> tracks(4, track_at(8.0, 1.0));
    for (Track& track : tracks) {
      track.position_m += Eigen::Vector2d(unit(random), unit(random));
      track.detection_variance_m2 = std::pow(10.0, -3.0 + 3.0 * unit(random));
    }
    const std::vector<Observation> observations{observation_at(8.5, 1.5)};
    const std::vector<Match> matches = match(tracks, observations, {}, {});

    // Brute force.
    std::vector<double> costs;
    for (const Track& track : tracks) costs.push_back(cost(track, observations[0]));
    const auto best = std::min_element(costs.begin(), costs.end());
    REQUIRE(matches.size() == (std::isfinite(*best) ? 1U : 0U));
    if (matches.empty()) continue;
    REQUIRE(matches[0].track == best - costs.begin());

    // By its distance alone it would often have been a wider one.
    const auto nearest = std::min_element(tracks.begin(), tracks.end(), [&](auto& a, auto& b) {
      return cost(a, observations[0]) - log_spread(a, observations[0]) <
             cost(b, observations[0]) - log_spread(b, observations[0]);
    });
    if (nearest - tracks.begin() != best - costs.begin()) ++wider_and_taken;
  }
  CHECK(wider_and_taken > 50);
}

TEST_CASE("No swap of two observations makes a scan likelier", "[associator]") {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> place(0.0, 1.2);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Track> tracks;
    std::vector<Observation> observations;
    for (int i = 0; i < 8; ++i) {
      tracks.push_back(track_at(8.0 + place(random), place(random)));
      observations.push_back(observation_at(8.0 + place(random), place(random)));
    }
    const std::vector<Match> matches = match(tracks, observations, {}, {});
    for (const Match& a : matches) {
      for (const Match& b : matches) {
        const auto pair_cost = [&](const Match& track, const Match& observation) {
          return cost(tracks[track.track], observations[observation.observation]);
        };
        REQUIRE(pair_cost(a, b) + pair_cost(b, a) > pair_cost(a, a) + pair_cost(b, b) - 1e-6);
      }
    }
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
