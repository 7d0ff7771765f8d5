// Scans that come late beside odometry: nothing is lost by it, and poses go on meanwhile.
#include <deque>
#include <random>

#include "common/model/archive.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// A scan and the step with which it arrives.
struct Late {
  std::size_t at_step = 0;
  model::TrackedScan scan;
};

/// A filter's pose, map and biases as bytes.
std::string bytes_of(const EkfOutput& output) {
  state::Writer out;
  out(*output.pose);
  for (const model::EkfLandmark& landmark : output.map->landmarks)
    out(landmark.track_id, landmark.position_m, landmark.covariance_m2);
  return out.take();
}

/// What is published: their stamps go on, and their errors are as stated.
class Published {
 public:
  explicit Published(geometry::SE2 start) : start_(start) {}
  void add(const EkfOutput& output, const std::map<model::Utime, geometry::SE2>& truth) {
    if (!output.pose || output.is_late) return;
    CHECK(output.pose->utime > newest_);
    newest_ = output.pose->utime;
    CHECK(output.pose->reset_counter == 0);
    const auto is = truth.find(output.pose->utime);
    if (is == truth.end()) return;
    nees_.push_back(nees(*output.pose, start_.inverse() * is->second));
  }
  const std::vector<double>& nees_of_poses() const { return nees_; }

 private:
  geometry::SE2 start_;
  model::Utime newest_ = -1;
  std::vector<double> nees_;
};

}  // namespace

TEST_CASE("Scans that come up to 10 s late give the estimate of scans in time", "[ekf]") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U, 5U);
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  sim::InertialDriveParameters parameters = short_drive();
  parameters.odometry =
      seed % 2 == 0 ? sim::OdometryKind::kInertial : sim::OdometryKind::kInertialAndWheels;
  sim::InertialDrive drive(parameters, trunks(), seed);
  Ekf in_time(white_noise());
  Ekf late(white_noise());

  std::map<model::Utime, geometry::SE2> truth;
  std::deque<Late> on_the_way;
  std::deque<std::string> expected;
  std::optional<Published> published;
  std::size_t delayed_until = 0;
  const auto deliver = [&](std::size_t step) {
    while (!on_the_way.empty() && on_the_way.front().at_step <= step) {
      const EkfOutput output = late.add(on_the_way.front().scan);
      REQUIRE(output.pose);
      CHECK(bytes_of(output) == expected.front());
      published->add(output, truth);
      on_the_way.pop_front();
      expected.pop_front();
    }
  };

  for (std::size_t k = 0; k < 400; ++k) {
    const sim::DriveStep step = drive.next();
    if (!published) published.emplace(step.world_T_vehicle);
    truth[step.scan.utime] = step.world_T_vehicle;
    for (const model::Odometry& increment : step.odometry) {
      in_time.add(increment);
      published->add(late.add(increment), truth);
    }

    // Now and then the extractor hangs; then all comes at once.
    if (k > 30 && k >= delayed_until && random() % 20 == 0) delayed_until = k + random() % 100;
    expected.push_back(bytes_of(in_time.add(true_tracks(step))));
    on_the_way.push_back({std::max(k, delayed_until), true_tracks(step)});
    deliver(k);
  }

  deliver(1000);
  CHECK(late.counters().scans_refused == 0);
  CHECK(late.counters().odometry_refused == 0);
  double mean = 0.0;
  const std::vector<double>& all = published->nees_of_poses();
  for (const double one : all) mean += one / static_cast<double>(all.size());
  CHECK(mean < 6.0);
}

TEST_CASE("A scan that is too late is refused, and the filter goes on", "[ekf]") {
  sim::InertialDrive drive(short_drive(), trunks(), 8);
  Ekf filter(white_noise());
  std::optional<model::TrackedScan> missed;
  geometry::SE2 start;
  EkfOutput last;
  for (int k = 0; k < 250; ++k) {
    const sim::DriveStep step = drive.next();
    if (k == 0) start = step.world_T_vehicle;
    for (const model::Odometry& increment : step.odometry) filter.add(increment);
    const bool is_silent = k >= 80 && k < 230;
    if (k == 80) missed = true_tracks(step);
    if (!is_silent) last = filter.add(true_tracks(step));
    if (k == 220) CHECK_FALSE(filter.add(*missed).pose);
    if (k == 249) CHECK(nees(*last.pose, start.inverse() * step.world_T_vehicle) < 30.0);
  }
  CHECK(filter.counters().scans_refused == 1);
}

TEST_CASE("Without any wait for scans each increment gives a pose, and scans are used", "[ekf]") {
  EkfParameters parameters = white_noise();
  parameters.max_scan_delay_s = 0.0;
  sim::InertialDrive drive(short_drive(), trunks(), 9);
  Ekf filter(parameters);
  for (int k = 0; k < 60; ++k) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) {
      const EkfOutput output = filter.add(increment);
      if (filter.utime() > 0) CHECK(output.pose);
    }
    filter.add(true_tracks(step));
  }
  CHECK(filter.counters().landmarks_used > 100);
  CHECK(filter.counters().scans_refused == 0);
}
