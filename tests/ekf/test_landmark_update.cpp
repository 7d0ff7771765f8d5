// Landmarks' innovations, the joint update and joint compatibility against brute force.
#include <limits>

#include "services/ekf/gates.hpp"
#include "services/ekf/joint_compatibility.hpp"
#include "services/ekf/landmark_update.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

Eigen::MatrixXd measurement_rows(const FilterState& state, const std::vector<Pairing>& pairings,
                                 const std::vector<Observation>& observations) {
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(2 * static_cast<Eigen::Index>(pairings.size()), state.size());
  for (std::size_t k = 0; k < pairings.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    rows.block<2, 1>(at, kHeading) = heading_row(state, pairings[k].landmark);
    rows.block<2, 2>(at, kPosition) = -Eigen::Matrix2d::Identity();
    rows.block<2, 2>(at, FilterState::row(pairings[k].landmark)).setIdentity();
    rows.block<2, 2>(at, kLevel) =
        level_rows(state, observations[pairings[k].observation].height_m);
  }
  return rows;
}

std::vector<Observation> observations_near(const FilterState& state, double sigma,
                                           std::mt19937_64& random) {
  std::vector<Observation> observations;
  for (const MapLandmark& landmark : state.landmarks()) {
    Observation observation;
    observation.height_m = 2.0 * test::normal(random);
    observation.position_m =
        rotation_of(state.heading).transpose() * (landmark.position - state.position) +
        observation.height_m * level_displacement() * state.level +
        sigma * Eigen::Vector2d(test::normal(random), test::normal(random));
    observation.covariance_m2 << 0.02, 0.004, 0.004, 0.01;
    observations.push_back(observation);
  }
  return observations;
}

/// Joint squared distance of pairings, on full matrices.
double joint_distance(const FilterState& state, const std::vector<Observation>& observations,
                      const std::vector<Pairing>& pairings) {
  const Eigen::MatrixXd rows = measurement_rows(state, pairings, observations);
  Eigen::MatrixXd spread = rows * full_covariance(state) * rows.transpose();
  Eigen::VectorXd error(rows.rows());
  const Eigen::Matrix2d rotation = rotation_of(state.heading);
  for (std::size_t k = 0; k < pairings.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    const Observation& observation = observations[pairings[k].observation];
    spread.block<2, 2>(at, at) += rotation * observation.covariance_m2 * rotation.transpose();
    error.segment<2>(at) = innovation(state, pairings[k].landmark, observation);
  }
  return error.dot(spread.llt().solve(error));
}

}  // namespace

TEST_CASE("Innovations depend on the error by their Jacobian", "[ekf][update]") {
  std::mt19937_64 random(21);
  for (const ErrorForm form : test::kForms) {
    const FilterState state = random_state(form, 3, random);
    const Observation observation = observations_near(state, 0.0, random)[1];
    const Eigen::MatrixXd rows = measurement_rows(state, {{0, 1}}, {observation});
    for (int k = 0; k < state.size(); ++k) {
      const double h = 1e-6;
      FilterState plus = state, minus = state;
      plus.retract(h * Eigen::VectorXd::Unit(state.size(), k));
      minus.retract(-h * Eigen::VectorXd::Unit(state.size(), k));
      // The innovation falls by what the prediction gains, in the axes of the estimate.
      const auto predicted = [&](const FilterState& at) {
        return Eigen::Vector2d(
            rotation_of(state.heading) *
            (rotation_of(at.heading).transpose() * (at.landmarks()[1].position - at.position) +
             observation.height_m * level_displacement() * at.level));
      };
      const Eigen::Vector2d column = (predicted(plus) - predicted(minus)) / (2 * h);
      CAPTURE(static_cast<int>(form), k);
      REQUIRE((column - rows.col(k)).norm() < 1e-8);
    }
    REQUIRE(innovation(state, 1, observation).norm() < 1e-9);
  }
}

TEST_CASE("Steps of a few landmarks give what one full update gives", "[ekf][update]") {
  std::mt19937_64 random(22);
  for (const ErrorForm form : test::kForms) {
    for (const int count : {1, 5, 16, 17, 40}) {
      FilterState state = random_state(form, count, random);
      const auto observations = observations_near(state, 0.2, random);
      std::vector<Pairing> pairings;
      for (std::uint32_t k = 0; k < observations.size(); ++k) pairings.push_back({k, k});
      const Eigen::MatrixXd before = full_covariance(state);
      const Eigen::MatrixXd rows = measurement_rows(state, pairings, observations);
      Eigen::MatrixXd spread = rows * before * rows.transpose();
      Eigen::VectorXd error(rows.rows());
      const Eigen::Matrix2d rotation = rotation_of(state.heading);
      for (std::size_t k = 0; k < pairings.size(); ++k) {
        const auto at = 2 * static_cast<Eigen::Index>(k);
        spread.block<2, 2>(at, at) +=
            rotation * observations[k].covariance_m2 * rotation.transpose();
        error.segment<2>(at) = innovation(state, k, observations[k]);
      }
      const Eigen::MatrixXd gain = before * rows.transpose() * spread.inverse();
      FilterState oracle = state;
      oracle.retract(gain * error);
      LowRank low_rank(state.size());
      JointUpdate update(count + 4);
      const double distance = update.apply(state, observations, pairings, low_rank);
      update.finish(state, low_rank);
      const Eigen::MatrixXd expected = before - gain * rows * before;
      CAPTURE(static_cast<int>(form), count);
      REQUIRE(distance == Approx(error.dot(spread.llt().solve(error))).epsilon(1e-8));
      REQUIRE((full_covariance(state) - expected).norm() < 1e-9 * before.norm());
      REQUIRE(difference(oracle, state).norm() < 1e-8);
    }
  }
}

TEST_CASE("Joint compatibility finds what trying everything finds", "[ekf][jcbb]") {
  std::mt19937_64 random(23);
  const std::vector<double> limits = set_gates(0.95, 3);
  for (int trial = 0; trial < 40; ++trial) {
    const ErrorForm form = test::kForms[trial % 3];
    const FilterState state = random_state(form, 4, random);
    auto observations = observations_near(state, 0.3, random);
    observations.pop_back();
    std::vector<Candidates> candidates;
    for (std::uint32_t k = 0; k < observations.size(); ++k) candidates.push_back({k, {0, 1, 2, 3}});
    const auto found =
        joint_compatibility(state, observations, candidates, {limits, 200000}).pairings;
    // Every assignment: 4 = none.
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int code = 0; code < 125; ++code) {
      std::vector<Pairing> pairings;
      bool one_to_one = true;
      for (std::uint32_t k = 0, rest = static_cast<std::uint32_t>(code); k < 3; ++k, rest /= 5) {
        if (rest % 5 == 4) continue;
        for (const Pairing& p : pairings) one_to_one = one_to_one && p.landmark != rest % 5;
        pairings.push_back({k, rest % 5});
      }
      if (!one_to_one || pairings.empty()) continue;
      // Compatible at every step, as the search builds it up.
      bool compatible = true;
      for (std::size_t m = 1; m <= pairings.size(); ++m) {
        const std::vector<Pairing> part(pairings.begin(),
                                        pairings.begin() + static_cast<std::ptrdiff_t>(m));
        compatible = compatible && joint_distance(state, observations, part) <= limits[m];
      }
      if (!compatible) continue;
      const double distance = joint_distance(state, observations, pairings);
      if (pairings.size() > best || (pairings.size() == best && distance < least)) {
        best = pairings.size();
        least = distance;
      }
    }
    REQUIRE(found.size() == best);
    if (best > 0) REQUIRE(joint_distance(state, observations, found) == Approx(least));
  }
}
