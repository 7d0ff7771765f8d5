// Sweeps and scans that wait: order, late ones, stamps that advance, what is saved.
#include "services/lidar_imu_input/sweep_queue.hpp"

#include "common/model/archive.hpp"
#include "common/state/archive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

namespace {

WaitingSweep sweep(model::Utime end) { return {end, model::PointSweep{}}; }

WaitingSweep scan(model::Utime end) {
  model::PlanarScan scan;
  scan.utime = end;
  return {end, scan};
}

}  // namespace

TEST_CASE("what waits is in order of its end, and the oldest makes room", "[stage]") {
  SweepQueue queue;
  queue.add(sweep(300), {});
  queue.add(scan(100), {});
  queue.add(sweep(200), {});
  for (const model::Utime end : {100, 200, 300}) CHECK(queue.take().end == end);
  CHECK(queue.empty());

  for (model::Utime end = 1; end <= 20; ++end)
    CHECK_FALSE(queue.add(sweep(end), {}).dropped_oldest);
  CHECK(queue.add(sweep(21), {}).dropped_oldest);
  CHECK(queue.front().end == 2);
}

TEST_CASE("late sweeps are carried, later ones and late scans dropped", "[stage]") {
  SweepQueue queue;
  CHECK_FALSE(queue.add(sweep(900'000), 900'000).is_carried);
  CHECK(queue.add(sweep(800'000), 900'000).is_carried);
  CHECK(queue.front().end == 900'000);
  CHECK(queue.add(sweep(600'000), 900'000).fault);
  CHECK(queue.add(scan(800'000), 900'000).fault);

  // A stamp that was released is not released again, nor waited for.
  CHECK(queue.release(queue.take()));
  CHECK_FALSE(queue.release(queue.take()));
  CHECK(queue.empty());
  CHECK(queue.add(sweep(800'000), 900'000).fault);
}

TEST_CASE("scans outlive a restart, points of sweeps do not", "[state]") {
  SweepQueue queue;
  queue.add(sweep(100), {});
  queue.add(scan(200), {});
  SweepQueue loaded;
  state::load(state::save({"queue"}, queue), {"queue"}, loaded);
  CHECK_FALSE(loaded.release(loaded.take()));
  CHECK(loaded.front().end == 200);
  CHECK(loaded.release(loaded.take()));
}
