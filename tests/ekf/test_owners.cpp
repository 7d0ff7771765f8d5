// The parts of the filter's state, each by itself.
#include "services/ekf/compatible_update.hpp"
#include "services/ekf/gates.hpp"
#include "services/ekf/odometry_queue.hpp"
#include "services/ekf/timeline.hpp"
#include "services/ekf/track_aliases.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

model::Odometry increment(model::Utime from, model::Utime to) {
  model::Odometry result;
  result.from_utime = from;
  result.utime = to;
  return result;
}

/// A landmark's exact observation.
Observation exact(const FilterState& state, std::size_t landmark) {
  Observation observation;
  observation.position_m = rotation_of(state.heading).transpose() *
                           (state.landmarks()[landmark].position - state.position);
  observation.covariance_m2 = 0.01 * Eigen::Matrix2d::Identity();
  return observation;
}

}  // namespace

TEST_CASE("Odometry waits for its scan, but not for ever", "[ekf][queue]") {
  OdometryQueue queue(0.4, 10.0);
  CHECK(!queue.overdue());
  for (int k = 0; k < 4; ++k) queue.push(increment(100000 * k, 100000 * (k + 1)));
  CHECK(!queue.overdue());
  queue.push(increment(400000, 500000));
  CHECK(queue.overdue() == model::Utime{100000});

  CHECK(queue.take_ended_by(100000 - kTolerance_us)->utime == 100000);
  CHECK(!queue.take_ended_by(200000 - kTolerance_us - 1));
  CHECK(queue.next()->utime == 200000);
  queue.clear();
  CHECK(queue.next() == nullptr);
}

TEST_CASE("Odometry is late against what waits, or against the filter", "[ekf][queue]") {
  OdometryQueue queue(0.4, 10.0);
  const model::Utime now = 20'000'000;
  CHECK(queue.order_of(increment(now, now + 100000), now) == StampOrder::kInOrder);
  CHECK(queue.order_of(increment(now - kTolerance_us, now + 1), now) == StampOrder::kInOrder);
  CHECK(queue.order_of(increment(now - kTolerance_us - 1, now + 1), now) == StampOrder::kLate);
  queue.push(increment(now, now + 100000));
  CHECK(queue.order_of(increment(now, now + 100000), now) == StampOrder::kLate);
  CHECK(queue.order_of(increment(0, now + 100000 - 10'000'000), now) == StampOrder::kLate);
  CHECK(queue.order_of(increment(0, now + 99999 - 10'000'000), now) ==
        StampOrder::kClockJumpedBack);
}

TEST_CASE("An increment lies before, across, at or after the filter's time", "[ekf][timeline]") {
  Timeline timeline(1.0, 10.0);
  CHECK(!timeline.has_begun());
  timeline.begin(1000000);
  CHECK(timeline.has_begun());
  CHECK(timeline.interval_of(increment(900000, 1000000 + kTolerance_us)) == Interval::kPast);
  CHECK(timeline.interval_of(increment(900000, 1100000)) == Interval::kOverlaps);
  CHECK(timeline.interval_of(increment(1000000 - kTolerance_us, 1100000)) == Interval::kFollows);
  CHECK(timeline.interval_of(increment(1000000 + kTolerance_us, 1100000)) == Interval::kFollows);
  CHECK(timeline.interval_of(increment(1050000, 1100000)) == Interval::kAfterGap);
}

TEST_CASE("A scan is in order, late, or from a clock that jumped back", "[ekf][timeline]") {
  Timeline timeline(1.0, 10.0);
  timeline.begin(50'000'000);
  CHECK(timeline.order_of_scan(50'000'000) == StampOrder::kInOrder);
  CHECK(timeline.order_of_scan(50'000'000 - kTolerance_us - 1) == StampOrder::kLate);
  timeline.set_last_scan(50'000'000);
  CHECK(timeline.order_of_scan(50'000'000) == StampOrder::kLate);
  CHECK(timeline.order_of_scan(40'000'000) == StampOrder::kLate);
  CHECK(timeline.order_of_scan(39'999'999) == StampOrder::kClockJumpedBack);
  timeline.forget_scans();
  CHECK(timeline.order_of_scan(50'000'000) == StampOrder::kInOrder);
}

TEST_CASE("A landmark is known by all of its tracks until it leaves", "[ekf][aliases]") {
  std::mt19937_64 random(31);
  FilterState state = random_state(ErrorForm::kRightInvariant, 3, random);
  TrackAliases aliases;
  for (model::TrackId id = 1; id <= 3; ++id) aliases.set(id, id);
  aliases.set(70, 2);
  CHECK(aliases.landmark_of(state, 70) == 1u);
  CHECK(aliases.landmark_of(state, 2) == 1u);
  CHECK(!aliases.landmark_of(state, 4));

  const std::vector<model::TrackId> tracks{9, 3, 70};
  const std::vector<Pairing> known = aliases.known(state, tracks);
  REQUIRE(known.size() == 2);
  CHECK(known[0].observation == 1);
  CHECK(known[0].landmark == 2);
  CHECK(known[1].landmark == 1);

  state.remove_landmark(1);
  aliases.forget_landmark(2);
  CHECK(!aliases.landmark_of(state, 70));
  CHECK(aliases.landmark_of(state, 3) == 1u);
}

TEST_CASE("An update at odds with the map leaves the state as it was", "[ekf][update]") {
  std::mt19937_64 random(32);
  for (const ErrorForm form : kForms) {
    FilterState state = random_state(form, 6, random);
    UpdateScratch scratch(state.max_landmarks());
    std::vector<Observation> observations;
    std::vector<Pairing> pairings;
    for (std::uint32_t k = 0; k < 6; ++k) {
      observations.push_back(exact(state, k));
      observations.back().position_m.x() += 1000.0;
      pairings.push_back({k, k});
    }
    const Eigen::MatrixXd before = full_covariance(state);
    const geometry::SE2 pose(state.position, state.heading);

    const std::vector<double> gates = set_gates(0.999, 6);
    CHECK(update_compatible(state, observations, pairings, gates, scratch).removed == 6);
    CHECK(pairings.empty());
    CHECK(full_covariance(state) == before);
    CHECK(geometry::SE2(state.position, state.heading).coordinates() == pose.coordinates());
  }
}

TEST_CASE("The worst pairing goes, and the rest updates as if it had never been", "[ekf][update]") {
  std::mt19937_64 random(33);
  FilterState state = random_state(ErrorForm::kRightInvariant, 5, random);
  UpdateScratch scratch(state.max_landmarks());
  const std::vector<double> gates = set_gates(0.999, 5);
  std::vector<Observation> observations;
  for (std::size_t k = 0; k < 5; ++k) observations.push_back(exact(state, k));
  observations[2].position_m.y() += 50.0;

  FilterState without = state;
  std::vector<Pairing> four{{0, 0}, {1, 1}, {3, 3}, {4, 4}};
  CHECK(update_compatible(without, observations, four, gates, scratch).removed == 0);
  std::vector<Pairing> five{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  CHECK(update_compatible(state, observations, five, gates, scratch).removed == 1);
  CHECK(five.size() == 4);
  CHECK(state.landmarks()[2].refused == 1);
  CHECK(full_covariance(state) == full_covariance(without));
  CHECK(state.position == without.position);
}

TEST_CASE("Gates grow with the number of landmarks", "[ekf][gates]") {
  const Gates gates(EkfGateParameters{}, 40);
  REQUIRE(gates.set.size() == 41);
  REQUIRE(gates.rejoin.size() == kMaxSearched + 1);
  CHECK(gates.set[0] == 0.0);
  CHECK(gates.set[1] == Approx(13.81551).epsilon(1e-5));
  for (std::size_t k = 1; k < gates.set.size(); ++k) CHECK(gates.set[k] > gates.set[k - 1]);
  // Tables: probability 1 - 1e-6 with 2, 3 and 4 degrees of freedom.
  CHECK(gates.stationary.velocity == Approx(27.63102).epsilon(1e-5));
  CHECK(gates.stationary.common_motion == Approx(30.66485).epsilon(1e-5));
  CHECK(gates.stationary.ground_marks == Approx(33.37684).epsilon(1e-5));
}
