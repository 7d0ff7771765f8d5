// Tracks of simulated drives against the truth, and the stage under nonsense.
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "common/model/archive.hpp"
#include "services/associator/associator.hpp"
#include "sim/inertial_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::associator;

namespace {

const sim::TrunkField& trunks() {
  static const sim::TrunkField field = [] {
    sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
    forest.side_m = 400.0;
    return sim::make_trunk_field(forest, 2);
  }();
  return field;
}

sim::InertialDriveParameters fast_drive() {
  sim::InertialDriveParameters drive;
  drive.stationary_s = 1.0;
  drive.speed_mps = 8.0;
  drive.acceleration_mps2 = 3.0;
  drive.loop_length_m = 800.0;
  drive.position_sigma_m = 0.2;
  drive.clutter_share = 0.1;
  return drive;
}

struct Score {
  double purity = 0.0;
  int switches = 0;
  double share = 0.0;
  std::uint64_t lost = 0;
};

Score score(const sim::InertialDriveParameters& parameters, const std::string& method,
            double seconds, std::uint64_t seed) {
  sim::InertialDrive drive(parameters, trunks(), seed);
  AssociatorParameters associator_parameters;
  associator_parameters.method = method;
  Associator associator(associator_parameters);
  std::map<model::TrackId, std::map<std::int64_t, int>> observed;
  std::map<std::int64_t, model::TrackId> current;
  Score out;
  double published = 0.0, possible = 0.0, pure = 0.0;
  for (int k = 0; k < static_cast<int>(10 * seconds); ++k) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) associator.add(increment);
    const model::TrackedScan tracked = *associator.add(step.scan);
    std::map<std::int64_t, model::TrackId> now;
    for (const model::TrackedLandmark& landmark : tracked.landmarks) {
      const std::int64_t trunk = step.trunks[landmark.detection];
      ++observed[landmark.track_id][trunk];
      const auto before = current.find(trunk);
      if (trunk >= 0 && before != current.end() && before->second != landmark.track_id) {
        ++out.switches;
      }
      if (trunk >= 0) current[trunk] = landmark.track_id;
    }
    published += static_cast<double>(tracked.landmarks.size());
    possible += static_cast<double>(
        std::count_if(step.trunks.begin(), step.trunks.end(), [](auto t) { return t >= 0; }));
  }
  for (const auto& [id, counts] : observed) {
    int most = 0;
    for (const auto& [trunk, count] : counts) most = trunk >= 0 ? std::max(most, count) : most;
    pure += most;
  }
  out.purity = pure / published;
  out.share = published / possible;
  out.lost = associator.counters().scans_lost;
  return out;
}

/// The landmarks that a scan gives; a range-for over `add(...)->landmarks` would outlive them.
std::vector<model::TrackedLandmark> landmarks_of(Associator& associator,
                                                 const model::LandmarkScan& scan) {
  const auto tracked = associator.add(scan);
  return tracked ? tracked->landmarks : std::vector<model::TrackedLandmark>{};
}

model::LandmarkScan grid_scan(model::Utime utime,
                              model::LandmarkKind kind = model::LandmarkKind::kTrunk) {
  model::LandmarkScan scan;
  scan.utime = utime;
  scan.field_of_view.max_range_m = 30.0;
  for (int i = 0; i < 12; ++i) {
    model::Detection detection;
    detection.position_m << 5.0 * (i % 4) + 0.7 * i, 6.0 * (i / 4) - 5.0, 0.0;
    detection.covariance_m2 = 0.01 * Eigen::Matrix3d::Identity();
    detection.kind = kind;
    scan.detections.push_back(detection);
  }
  return scan;
}

}  // namespace

TEST_CASE("Tracks are pure and last, with odometry of every kind and with none", "[associator]") {
  for (const auto odometry :
       {sim::OdometryKind::kInertial, sim::OdometryKind::kWheels, sim::OdometryKind::kNone}) {
    sim::InertialDriveParameters drive = fast_drive();
    drive.odometry = odometry;
    const Score result = score(drive, "auto", 40.0, 3);
    CAPTURE(static_cast<int>(odometry), result.purity, result.switches, result.share);
    REQUIRE(result.purity > 0.9991);
    REQUIRE(result.switches <= 1);
    REQUIRE(result.share > 0.9);
    REQUIRE(result.lost == 0);
  }
}

TEST_CASE("Without odometry the pose must be refined: nearest alone fails", "[associator]") {
  sim::InertialDriveParameters drive = fast_drive();
  drive.odometry = sim::OdometryKind::kNone;
  REQUIRE(score(drive, "nearest", 25.0, 4).purity < 0.7);
  REQUIRE(score(drive, "consistent", 25.0, 4).purity > 0.9996);
}

TEST_CASE("A track gets its id after k matches in n scans", "[associator]") {
  const AssociatorParameters parameters;
  Associator associator(parameters);
  for (int k = 1; k <= 8; ++k) {
    const model::TrackedScan tracked = *associator.add(grid_scan(100000 * k));
    REQUIRE(tracked.landmarks.size() == (k < parameters.confirm_matches ? 0u : 12u));
    for (const model::TrackedLandmark& landmark : tracked.landmarks) {
      REQUIRE(landmark.track_id > 0);
      REQUIRE(landmark.observed.position_m ==
              grid_scan(0).detections[landmark.detection].position_m);
    }
  }
}

TEST_CASE("A trunk is never matched with a corner", "[associator]") {
  Associator associator((AssociatorParameters()));
  std::set<model::TrackId> of_trunks;
  for (int k = 1; k <= 8; ++k) {
    for (const auto& landmark : landmarks_of(associator, grid_scan(100000 * k))) {
      of_trunks.insert(landmark.track_id);
    }
  }
  REQUIRE(of_trunks.size() == 12);
  for (int k = 9; k <= 30; ++k) {
    const auto tracked = associator.add(grid_scan(100000 * k, model::LandmarkKind::kCorner));
    for (const auto& landmark : tracked->landmarks) {
      REQUIRE(of_trunks.count(landmark.track_id) == 0);
    }
  }
}

TEST_CASE("A track that is in view without a match ends; its id is never used again",
          "[associator]") {
  const AssociatorParameters parameters;
  Associator associator(parameters);
  model::Utime utime = 0;
  const auto ids_after = [&](int scans, bool with_first) {
    std::set<model::TrackId> ids;
    for (int k = 0; k < scans; ++k) {
      model::LandmarkScan scan = grid_scan(utime += 100000);
      if (!with_first) scan.detections.erase(scan.detections.begin());
      ids.clear();
      for (const auto& landmark : landmarks_of(associator, scan)) ids.insert(landmark.track_id);
    }
    return ids;
  };
  const auto all = ids_after(8, true);
  REQUIRE(all.size() == 12);
  ids_after(parameters.max_missed - 2, false);
  REQUIRE(ids_after(1, true) == all);  // Hidden for a while: the same track.
  ids_after(parameters.max_missed + 2, false);
  const auto later = ids_after(8, true);
  REQUIRE(later.size() == 12);
  REQUIRE(*later.rbegin() > *all.rbegin());
}

TEST_CASE("Late, repeated and broken scans do no harm", "[associator]") {
  Associator associator((AssociatorParameters()));
  for (int k = 1; k <= 6; ++k) associator.add(grid_scan(100000 * k));
  const std::string before = associator.save();
  REQUIRE(!associator.add(grid_scan(600000)));
  REQUIRE(!associator.add(grid_scan(550000)));
  REQUIRE(associator.save() == before);
  model::LandmarkScan broken = grid_scan(700000);
  broken.detections[0].position_m.x() = std::numeric_limits<double>::quiet_NaN();
  broken.detections[1].covariance_m2.setZero();
  model::Odometry motion;
  motion.utime = 700000;
  motion.from_utime = 600000;
  motion.covariance.setConstant(std::numeric_limits<double>::infinity());
  associator.add(motion);
  REQUIRE(associator.add(broken)->landmarks.size() == 10);
  REQUIRE(associator.counters().detections_unusable == 2);
  model::LandmarkScan empty = grid_scan(800000);
  empty.detections.clear();
  REQUIRE(associator.add(empty)->landmarks.empty());
  REQUIRE(associator.add(grid_scan(900000))->landmarks.size() == 12);
}

TEST_CASE("Scans that fit nothing, one after another, start all tracks anew", "[associator]") {
  Associator associator((AssociatorParameters()));
  model::TrackId highest = 0;
  for (int k = 1; k <= 8; ++k) {
    for (const auto& landmark : landmarks_of(associator, grid_scan(100000 * k))) {
      highest = std::max(highest, landmark.track_id);
    }
  }
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-25.0, 25.0);
  model::LandmarkScan elsewhere = grid_scan(900000);
  for (model::Detection& detection : elsewhere.detections)
    detection.position_m << u(random), u(random), 0;
  for (int k = 9; k <= 16; ++k) {
    elsewhere.utime = 100000 * k;
    for (const auto& landmark : landmarks_of(associator, elsewhere)) {
      REQUIRE(landmark.track_id > highest);
    }
  }
  REQUIRE(associator.counters().scans_lost == 1);
}

TEST_CASE("A single scan that fits nothing is passed over, and the tracks live on",
          "[associator]") {
  Associator associator((AssociatorParameters()));
  std::set<model::TrackId> before;
  for (int k = 1; k <= 8; ++k) {
    for (const auto& landmark : landmarks_of(associator, grid_scan(100000 * k)))
      before.insert(landmark.track_id);
  }
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-25.0, 25.0);
  model::LandmarkScan elsewhere = grid_scan(900000);
  for (model::Detection& detection : elsewhere.detections)
    detection.position_m << u(random), u(random), 0;
  CHECK(landmarks_of(associator, elsewhere).empty());
  std::set<model::TrackId> after;
  for (const auto& landmark : landmarks_of(associator, grid_scan(1000000)))
    after.insert(landmark.track_id);
  CHECK(after == before);
  CHECK(associator.counters().scans_passed_over == 1);
  CHECK(associator.counters().scans_lost == 0);
}

/// The outputs of a drive, each as bytes; the associator is stopped before the scan `restart`.
std::vector<std::string> outputs(const AssociatorParameters& parameters, sim::OdometryKind odometry,
                                 std::uint64_t seed, std::optional<int> restart) {
  sim::InertialDriveParameters drive_parameters = fast_drive();
  drive_parameters.odometry = odometry;
  sim::InertialDrive drive(drive_parameters, trunks(), seed);
  std::optional<Associator> associator(parameters);
  std::vector<std::string> bytes;
  for (int k = 0; k < 60; ++k) {
    if (restart == k) {
      const std::string saved = associator->save();
      associator.emplace(parameters);
      associator->load(saved);
      REQUIRE(associator->save() == saved);
    }
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) associator->add(increment);
    const auto tracked = associator->add(step.scan);
    bytes.push_back(state::save({"output", 1}, tracked));

    // The filter's pose, one scan behind.
    model::EkfPose pose;
    pose.utime = step.scan.utime;
    pose.velocity_mps = step.world_T_vehicle.rotation().transpose() * step.velocity_mps;
    pose.velocity_covariance = 1e-3 * Eigen::Matrix2d::Identity();
    pose.bias = step.bias;
    associator->add(pose);
  }
  bytes.push_back(associator->save());
  return bytes;
}

TEST_CASE("A restarted associator continues as if it had not stopped", "[associator][state]") {
  AssociatorParameters parameters;
  parameters.method = GENERATE("auto", "consistent");
  const auto odometry = GENERATE(sim::OdometryKind::kInertial,
                                 sim::OdometryKind::kInertialAndWheels, sim::OdometryKind::kNone);
  const std::uint64_t seed = 1;
  const auto expected = outputs(parameters, odometry, seed, std::nullopt);
  for (const int restart : {0, 2, 25, 50}) {
    CAPTURE(parameters.method, static_cast<int>(odometry), restart);
    REQUIRE(outputs(parameters, odometry, seed, restart) == expected);
  }
}

TEST_CASE("Bytes that are no state are refused, and the state stays", "[associator][state]") {
  Associator associator((AssociatorParameters()));
  for (int k = 1; k <= 6; ++k) associator.add(grid_scan(100000 * k));
  const std::string before = associator.save();
  REQUIRE_THROWS_AS(associator.load("not a state"), std::invalid_argument);
  REQUIRE_THROWS_AS(associator.load(before.substr(0, before.size() - 1)), std::invalid_argument);
  REQUIRE(associator.save() == before);
}

TEST_CASE("An unknown method is refused", "[associator]") {
  AssociatorParameters wrong;
  wrong.method = "guess";
  REQUIRE_THROWS_AS(Associator(wrong), std::invalid_argument);
}

TEST_CASE("An hour of driving keeps the list of tracks short", "[associator][long]") {
  sim::InertialDriveParameters drive_parameters = fast_drive();
  drive_parameters.range_m = 12.0;
  sim::InertialDrive drive(drive_parameters, trunks(), 7);
  Associator associator((AssociatorParameters()));
  std::size_t most = 0;
  for (int k = 0; k < 36000; ++k) {
    const sim::DriveStep step = drive.next();
    for (const model::Odometry& increment : step.odometry) associator.add(increment);
    associator.add(step.scan);
    most = std::max(most, associator.track_count());
  }
  REQUIRE(most < 60);
  REQUIRE(associator.save().size() < 50000);
}
