// A stage that is saved in the middle of a drive, made anew and loaded, goes on as if nothing were.
#include <algorithm>
#include <random>
#include <stdexcept>
#include <variant>
#include <vector>

#include "common/wire/convert.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

using Event = std::variant<model::ImuSample, model::WheelSample, model::GnssFix, model::PlanarScan,
                           model::PointSweep, model::VelocityCorrection>;

model::Utime utime_of(const Event& event) {
  return std::visit([](const auto& value) { return value.utime; }, event);
}

struct DriveWith {
  bool wheels = true;
  bool sweeps = true;
  bool scans = false;
  bool gnss = false;
};

test::SensorErrors errors_of_drive() {
  test::SensorErrors errors;
  errors.gyro_bias = {0.003, -0.002, 0.004};
  errors.force_bias = {0.01, 0.01, 0.02};
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  errors.wheel_noise_mps = 0.02;
  errors.wheel_scale = 1.01;
  return errors;
}

model::PlanarScan scan_at(model::Utime utime) {
  model::PlanarScan scan;
  scan.utime = utime;
  scan.bearing_step_rad = 0.01;
  scan.max_range_m = 80.0;
  scan.ranges_m = {3.0F, 4.0F, static_cast<float>(utime % 1000)};
  return scan;
}

model::VelocityCorrection correction_at(const test::Drive& drive, model::Utime utime) {
  model::VelocityCorrection correction;
  correction.utime = utime;
  correction.velocity_mps << drive.speed(test::seconds(utime)), 0.02;
  correction.bias << 0.0041, 0.001, -0.002;
  correction.covariance.diagonal() << 1e-3, 1e-3, 1e-7, 1e-4, 1e-4;
  return correction;
}

/// All messages of the sensors in 40 s, in the first 22 of which the vehicle is stationary.
std::vector<Event> events_of(const DriveWith& with) {
  const test::Drive drive;
  const test::SensorErrors errors = errors_of_drive();
  const test::Track track(drive, 41.0);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> place(-30.0, 30.0);
  std::vector<Eigen::Vector3d> world;
  world.reserve(80);
  for (int i = 0; i < 80; ++i) world.emplace_back(place(random), place(random), 1.0);
  std::vector<Event> events;
  for (model::Utime t = 0; t < 40'000'000; t += 5'000) {
    events.emplace_back(imu_at(drive, t, 200.0, errors, random));
    if (with.wheels && t % 20'000 == 0) events.emplace_back(wheels_at(drive, t, errors, random));
    if (with.sweeps && t > 200'000 && t % 100'000 == 0)
      events.emplace_back(sweep_at(track, t - 103'000, Eigen::Isometry3d::Identity(), world));
    if (with.scans && t % 75'000 == 0) events.emplace_back(scan_at(t + 3'000));
    if (with.gnss && t % 1'000'000 == 0) {
      model::GnssFix fix;
      fix.utime = t;
      fix.east_north_m = track.planar(test::seconds(t)).translation();
      fix.sigma_m = 0.5;
      events.emplace_back(fix);
    }
    if (t > 23'000'000 && t % 500'000 == 0) events.emplace_back(correction_at(drive, t - 60'000));
  }
  return events;
}

void feed(LidarImuInput& stage, const Event& event, InputResults& all) {
  InputResults results = std::visit([&](const auto& value) { return stage.add(value); }, event);
  for (InputResult& result : results) all.push_back(std::move(result));
}

template <class T>
std::vector<T> all_of(const InputResults& results) {
  std::vector<T> found;
  for (const InputResult& result : results)
    if (const auto* value = std::get_if<T>(&result)) found.push_back(*value);
  return found;
}

int faults_of(const InputResults& results, InputFaultKind kind) {
  const auto faults = all_of<InputFault>(results);
  return static_cast<int>(std::ranges::count(faults, kind, &InputFault::kind));
}

/// Bit by bit, as on the wire.
template <class T>
void check_same(const std::vector<T>& is, const std::vector<T>& should) {
  REQUIRE(is.size() == should.size());
  for (std::size_t i = 0; i < is.size(); ++i)
    REQUIRE(wire::encode_message(is[i]) == wire::encode_message(should[i]));
}

bool same_point(const model::SweepPoint& a, const model::SweepPoint& b) {
  return a.x_m == b.x_m && a.y_m == b.y_m && a.z_m == b.z_m && a.time_s == b.time_s &&
         a.ring == b.ring;
}

/// Of those that came out, each is in `should` as it is.
void check_among(const std::vector<model::PointSweep>& is,
                 const std::vector<model::PointSweep>& should) {
  for (const model::PointSweep& sweep : is) {
    const auto same = std::ranges::find(should, sweep.utime, &model::PointSweep::utime);
    REQUIRE(same != should.end());
    REQUIRE(std::ranges::equal(sweep.points, same->points, same_point));
    REQUIRE(sweep.attitude.has_value() == same->attitude.has_value());
    if (!sweep.attitude) continue;
    REQUIRE(sweep.attitude->level_Q_vehicle.coeffs() == same->attitude->level_Q_vehicle.coeffs());
    REQUIRE(sweep.attitude->covariance_rad2 == same->attitude->covariance_rad2);
  }
}

void check_cut(const std::vector<Event>& events, std::size_t cut,
               const LidarImuInputParameters& parameters) {
  LidarImuInput uncut(parameters);
  InputResults before;
  for (std::size_t i = 0; i < cut; ++i) feed(uncut, events[i], before);
  LidarImuInput loaded(parameters);
  loaded.load(uncut.save());
  CHECK(loaded.motion().is_calibrated() == uncut.motion().is_calibrated());
  InputResults should;
  InputResults is;
  for (std::size_t i = cut; i < events.size(); ++i) {
    feed(uncut, events[i], should);
    feed(loaded, events[i], is);
  }
  check_same(all_of<model::Odometry>(is), all_of<model::Odometry>(should));
  check_same(all_of<model::RawPose>(is), all_of<model::RawPose>(should));
  check_same(all_of<model::ImuSample>(is), all_of<model::ImuSample>(should));
  check_same(all_of<model::WheelSample>(is), all_of<model::WheelSample>(should));
  check_same(all_of<model::PlanarScan>(is), all_of<model::PlanarScan>(should));
  CHECK(all_of<InputFault>(is).size() == all_of<InputFault>(should).size());
  const auto sweeps = all_of<model::PointSweep>(is);
  const auto all_sweeps = all_of<model::PointSweep>(should);
  check_among(sweeps, all_sweeps);
  const auto lost = loaded.counters().sweeps_dropped - uncut.counters().sweeps_dropped;
  CHECK(sweeps.size() + lost == all_sweeps.size());
  CHECK(lost <= 2);
}

std::size_t index_at(const std::vector<Event>& events, double time_s) {
  const auto it = std::ranges::find_if(
      events, [&](const Event& event) { return test::seconds(utime_of(event)) >= time_s; });
  return static_cast<std::size_t>(it - events.begin());
}

}  // namespace

TEST_CASE("a drive that is cut by saving and loading goes on bit by bit as the uncut one",
          "[state]") {
  std::mt19937_64 random(8);
  for (const DriveWith with :
       {DriveWith{}, DriveWith{.wheels = false}, DriveWith{.sweeps = false, .scans = true},
        DriveWith{.wheels = false, .scans = true, .gnss = true}}) {
    LidarImuInputParameters parameters = test::parameters_for_drive();
    parameters.gnss_aided = with.gnss;
    const std::vector<Event> events = events_of(with);
    std::uniform_int_distribution<std::size_t> any(1, events.size() - 200);
    const std::size_t driving = index_at(events, 24.0);
    for (const std::size_t cut :
         {std::size_t{0}, any(random), driving, driving + 1 + any(random) % 3000}) {
      check_cut(events, std::min(cut, events.size() - 200), parameters);
    }
  }
}

TEST_CASE(
    "a stage that is saved at the start of motion or while the IMU is late goes on bit by bit",
    "[state]") {
  std::vector<Event> events = events_of({});
  for (const double cut_s : {21.9, 22.05, 22.15, 22.25, 22.4})
    check_cut(events, index_at(events, cut_s), test::parameters_for_drive());

  // The IMU's samples of four seconds come in one burst at the end of them.
  const std::size_t from = index_at(events, 26.0);
  const std::size_t to = index_at(events, 30.0);
  const auto at = [&events](std::size_t i) {
    return events.begin() + static_cast<std::ptrdiff_t>(i);
  };
  const auto burst = std::stable_partition(at(from), at(to), [](const Event& event) {
    return !std::holds_alternative<model::ImuSample>(event);
  });
  const auto first_late = static_cast<std::size_t>(burst - events.begin());
  REQUIRE(first_late > from + 150);
  for (const std::size_t cut : {from + 50, from + 150, first_late, first_late + 300, to})
    check_cut(events, cut, test::parameters_for_drive());
}

TEST_CASE("a sweep that waits at the cut is dropped and counted", "[state]") {
  const std::vector<Event> events = events_of({});
  LidarImuInput stage(test::parameters_for_drive());
  InputResults all;
  std::size_t i = 0;
  // A sweep that comes before the motion of its time.
  for (; i < index_at(events, 30.0); ++i) feed(stage, events[i], all);
  const auto next = std::find_if(events.begin() + static_cast<std::ptrdiff_t>(i), events.end(),
                                 [](const Event& e) { return e.index() == 4; });
  feed(stage, *next, all);
  LidarImuInput loaded(test::parameters_for_drive());
  loaded.load(stage.save());
  CHECK(loaded.counters().sweeps_dropped == 0);
  for (; i < events.size(); ++i) {
    if (&events[i] != &*next) feed(loaded, events[i], all);
  }
  CHECK(loaded.counters().sweeps_dropped == 1);
}

TEST_CASE("after a pause the calibrated motion goes on, on the sensors' own clocks", "[state]") {
  const std::vector<Event> events = events_of({});
  LidarImuInput stage(test::parameters_for_drive());
  InputResults before;
  const std::size_t cut = index_at(events, 27.0);
  for (std::size_t i = 0; i < cut; ++i) feed(stage, events[i], before);
  LidarImuInput loaded(test::parameters_for_drive());
  loaded.load(stage.save());
  InputResults after;
  for (std::size_t i = index_at(events, 33.0); i < events.size(); ++i) {
    feed(loaded, events[i], after);
  }
  CHECK(loaded.motion().is_calibrated());
  CHECK(faults_of(after, InputFaultKind::kClockJump) == 0);
  CHECK(faults_of(after, InputFaultKind::kNotCalibrated) == 0);
  const auto samples = all_of<model::ImuSample>(after);
  REQUIRE_FALSE(samples.empty());
  CHECK(samples.front().utime == 33'000'000);
  CHECK(all_of<model::ImuSample>(after).back().utime == 39'995'000);
  const auto sweeps = all_of<model::PointSweep>(after);
  REQUIRE(sweeps.size() > 50);
  CHECK(std::ranges::all_of(sweeps, [](const auto& s) { return s.attitude.has_value(); }));
  // The rotation per increment: the gyro's bias of 0.23 degrees per second was learned before the
  // cut.
  const test::Drive drive;
  double turned = 0.0;
  double should = 0.0;
  for (const model::Odometry& increment : all_of<model::Odometry>(after)) {
    if (increment.from_utime < 33'100'000) continue;
    turned += increment.from_T_to.theta();
    should += drive.heading(test::seconds(increment.utime)) -
              drive.heading(test::seconds(increment.from_utime));
  }
  CHECK(turned == Approx(should).margin(0.006));
}

TEST_CASE("a state that is too old is not used", "[state]") {
  std::vector<Event> events = events_of({});
  LidarImuInput stage(test::parameters_for_drive());
  InputResults all;
  const std::size_t cut = index_at(events, 27.0);
  for (std::size_t i = 0; i < cut; ++i) feed(stage, events[i], all);
  LidarImuInput loaded(test::parameters_for_drive());
  loaded.load(stage.save());
  REQUIRE(loaded.motion().is_calibrated());
  InputResults after;
  for (std::size_t i = cut; i < events.size(); ++i) {
    std::visit([](auto& value) { value.utime += 3'600'000'000; }, events[i]);
    feed(loaded, events[i], after);
  }
  CHECK_FALSE(loaded.motion().is_calibrated());
  CHECK(faults_of(after, InputFaultKind::kNotCalibrated) >= 1);
  CHECK(faults_of(after, InputFaultKind::kClockJump) == 0);
  CHECK(all_of<model::Odometry>(after).front().from_utime > 3'600'000'000);
}

TEST_CASE("a damaged state is refused", "[state]") {
  const std::vector<Event> events = events_of({});
  LidarImuInput stage(test::parameters_for_drive());
  InputResults all;
  for (std::size_t i = 0; i < 3000; ++i) feed(stage, events[i], all);
  const std::string state = stage.save();
  LidarImuInput loaded(test::parameters_for_drive());
  const std::string before = loaded.save();
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{30}, state.size() / 3,
                                 state.size() / 2, state.size() - 1}) {
    CHECK_THROWS_AS(loaded.load(state.substr(0, size)), std::invalid_argument);
  }
  CHECK_THROWS_AS(loaded.load(state + "x"), std::invalid_argument);
  std::string other = state;
  other[8] = 'x';
  CHECK_THROWS_AS(loaded.load(other), std::invalid_argument);
  CHECK(loaded.save() == before);  // refused as a whole
  CHECK_NOTHROW(loaded.load(state));
  CHECK(loaded.save() == state);
}
