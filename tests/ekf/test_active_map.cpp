// How long landmarks stay in the filter's state.
#include "services/ekf/active_map.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/filter_fixture.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// A state with one landmark, 10 m ahead of the vehicle.
FilterState one_landmark() {
  std::mt19937_64 random(1);
  FilterState state = random_state(ErrorForm::kRightInvariant, 1, random);
  state.heading = 0.0;
  state.position.setZero();
  state.landmark(0).position << 10.0, 0.0;
  state.landmark(0).last_scan = 0;
  return state;
}

/// Scans that should observe the landmark; `does_observe` by their number.
template <class DoesObserve>
std::size_t landmarks_after(int scans, const EkfMapParameters& parameters,
                            const DoesObserve& does_observe) {
  FilterState state = one_landmark();
  ActiveMap map(parameters, {});
  EkfCounters counters;
  model::TrackedScan scan;
  scan.field_of_view.max_range_m = 30.0;
  scan.landmarks.resize(1);
  for (int k = 0; k < scans && !state.landmarks().empty(); ++k) {
    map.begin_scan();
    ScanUpdate update;
    update.observations.resize(1);
    update.scan_index = {0};
    update.tracks = {1};
    update.is_settled = {false};
    if (does_observe(k)) map.count_observed(scan, {0, 0}, state, update);
    map.count_missed(scan.field_of_view, state);
    map.remove_stale(scan.field_of_view, state, counters);
  }
  return state.landmarks().size();
}

}  // namespace

TEST_CASE("Only scans in a row without a landmark remove it", "[ekf][map]") {
  EkfMapParameters parameters;
  parameters.max_missed = 5;
  const auto never = [](int) { return false; };
  CHECK(landmarks_after(5, parameters, never) == 1);
  CHECK(landmarks_after(6, parameters, never) == 0);

  // Every sixth scan observes it: for ever. Every seventh does not.
  CHECK(landmarks_after(200, parameters, [](int k) { return k % 6 == 5; }) == 1);
  CHECK(landmarks_after(200, parameters, [](int k) { return k % 7 == 6; }) == 0);
}
