// A filter that is saved and loaded goes on with the outputs of an uninterrupted one, bit by bit.
#include <stdexcept>

#include "common/model/archive.hpp"
#include "tests/catch.hpp"
#include "tests/ekf/ekf_drive.hpp"

using namespace understory;
using namespace understory::ekf;
using namespace understory::test;

namespace {

/// All that is published, as bytes.
std::string bytes_of(const EkfOutput& output) {
  state::Writer out;
  out(output.pose, output.level, output.correction, output.map.has_value());
  if (!output.map) return out.take();
  out(output.map->utime);
  for (const model::EkfLandmark& landmark : output.map->landmarks) {
    out(landmark.track_id, landmark.position_m, landmark.covariance_m2, landmark.radius_m,
        landmark.kind, landmark.observation_count);
  }
  return out.take();
}

/// Two filters with the same input. One of them is a new object after each message.
class Pair {
 public:
  explicit Pair(const EkfParameters& parameters)
      : parameters_(parameters), uninterrupted_(parameters), restarted_(parameters) {}

  template <class Message>
  void add(const Message& message) {
    const EkfOutput expected = uninterrupted_.add(message);
    const EkfOutput actual = restarted_.add(message);
    REQUIRE(bytes_of(actual) == bytes_of(expected));

    Ekf fresh(parameters_);
    fresh.load(restarted_.save());
    REQUIRE(fresh.utime() == uninterrupted_.utime());
    restarts_ += restarted_.counters().restarts;
    crept_ += restarted_.counters().crept;
    rejoined_ += restarted_.counters().rejoined;
    restarted_ = std::move(fresh);
  }

  const Ekf& uninterrupted() const { return uninterrupted_; }
  const Ekf& restarted() const { return restarted_; }
  std::uint64_t restarts() const { return restarts_; }
  std::uint64_t crept() const { return crept_; }
  std::uint64_t rejoined() const { return rejoined_; }

 private:
  EkfParameters parameters_;
  Ekf uninterrupted_;
  Ekf restarted_;
  std::uint64_t restarts_ = 0;
  std::uint64_t crept_ = 0;
  std::uint64_t rejoined_ = 0;
};

/// What happens in the drive at step `k`, so that every part of the state is in use.
struct Events {
  bool has_odometry = true;
  bool has_scan = true;
  bool is_reported_stationary = false;
  bool is_at_odds = false;  ///< Landmarks are displaced by 5 m.
  model::TrackId track_offset = 1;
};

Events events_at(int k) {
  Events events;
  events.has_odometry = k < 90 || k >= 95;                         // A gap.
  events.has_scan = events.has_odometry && (k < 130 || k >= 140);  // Odometry alone.
  events.is_reported_stationary = k >= 60 && k < 80;               // A smooth road.
  events.is_at_odds = k >= 170 && k < 182;                         // Until the filter restarts.
  events.track_offset = k < 92 ? 1 : 1000000;                      // All tracks begin anew.
  return events;
}

}  // namespace

TEST_CASE("A restarted filter gives the outputs of an uninterrupted one", "[ekf][state]") {
  for (const auto odometry : {sim::OdometryKind::kInertial, sim::OdometryKind::kInertialAndWheels,
                              sim::OdometryKind::kWheels}) {
    sim::InertialDriveParameters parameters = short_drive();
    parameters.odometry = odometry;
    sim::InertialDrive drive(parameters, trunks(), 11);
    EkfParameters filter;
    filter.restart.after_refused_scans = 8;
    filter.map.max_refused = 1000;
    Pair pair(filter);

    for (int k = 0; k < 220; ++k) {
      CAPTURE(static_cast<int>(odometry), k);
      const Events events = events_at(k);
      const sim::DriveStep step = drive.next();
      for (model::Odometry increment : step.odometry) {
        increment.is_stationary = increment.is_stationary || events.is_reported_stationary;
        if (increment.inertial) increment.inertial->level.covariance.diagonal().setConstant(1e-6);
        if (events.has_odometry) pair.add(increment);
      }
      model::TrackedScan scan = true_tracks(step, events.track_offset);
      for (model::TrackedLandmark& landmark : scan.landmarks) {
        if (events.is_at_odds) landmark.observed.position_m.y() += 5.0;
      }
      if (events.has_scan) pair.add(scan);
    }

    CHECK(pair.restarted().save() == pair.uninterrupted().save());
    CHECK(pair.restarts() == pair.uninterrupted().counters().restarts);
    CHECK(pair.restarts() > 0);
    CHECK(pair.crept() > 0);
    CHECK(pair.rejoined() > 0);
  }
}

TEST_CASE("A state that cannot be loaded leaves the filter as it was", "[ekf][state]") {
  Driven run(5.0, short_drive());
  const std::string good = run.filter.save();

  CHECK_THROWS_AS(run.filter.load("not a state"), std::invalid_argument);
  CHECK_THROWS_AS(run.filter.load(good.substr(0, good.size() / 2)), std::invalid_argument);
  CHECK_THROWS_AS(run.filter.load(good.substr(0, good.size() - 1)), std::invalid_argument);
  CHECK_THROWS_AS(run.filter.load(good + '\0'), std::invalid_argument);
  CHECK(run.filter.save() == good);

  EkfParameters small;
  small.map.max_landmarks = 1;
  CHECK_THROWS_AS(Ekf(small).load(good), std::invalid_argument);
  EkfParameters plain;
  plain.error_form = "plain";
  CHECK_THROWS_AS(Ekf(plain).load(good), std::invalid_argument);
  plain.error_form = "crooked";
  CHECK_THROWS_AS(Ekf(plain), std::invalid_argument);
}

TEST_CASE("The saved covariance is its lower triangle", "[ekf][state]") {
  Driven run(8.0, short_drive());
  const auto landmarks = run.filter.state().landmarks().size();
  const std::size_t n = static_cast<std::size_t>(run.filter.state().size());
  const std::size_t triangle = sizeof(double) * n * (n + 1) / 2;
  const std::size_t size = run.filter.save().size();
  CAPTURE(landmarks, triangle, size);
  CHECK(size > triangle);
  CHECK(size < triangle + 200 * landmarks + 2000);
}
