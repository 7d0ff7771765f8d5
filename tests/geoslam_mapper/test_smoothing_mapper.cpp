#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "common/model/held_map.hpp"
#include "services/geoslam_mapper/map_difference.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

sim::Drive drive(sim::PathKind path, double length_m, std::uint64_t seed, double sigma_m = 0.2) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.kind = path;
  parameters.path.length_m = length_m;
  parameters.sensor.position_sigma_m = sigma_m;
  return {parameters, seed};
}

std::vector<model::Keyframe> keyframes(const sim::Drive& drive) {
  keyframer::joint::JointKeyframer keyframer({});
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (auto keyframe = keyframer.add(drive.scan(k).scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

std::vector<model::MapLandmark> true_map(const sim::Drive& drive) {
  std::vector<model::MapLandmark> map;
  for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
    model::MapLandmark landmark;
    landmark.position_m = trunk;
    landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    map.push_back(landmark);
  }
  return map;
}

double distance(const geometry::SE2& a, const geometry::SE2& b) {
  return (a.translation() - b.translation()).norm();
}

bool same_map(const SmoothingMapper& a, const std::vector<model::MapLandmark>& landmarks,
              const std::vector<model::KeyframePose>& poses) {
  const std::vector<model::MapLandmark> now = a.landmarks();
  const std::vector<model::KeyframePose> trajectory = a.trajectory();
  if (now.size() != landmarks.size() || trajectory.size() != poses.size()) return false;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].id != landmarks[i].id || now[i].position_m != landmarks[i].position_m) return false;
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (trajectory[i].map_T_vehicle.coordinates() != poses[i].map_T_vehicle.coordinates())
      return false;
  }
  return true;
}

}  // namespace

TEST_CASE("A drive round a circle gives a map of trunks, each once", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 100.0, 11);
  const geometry::SE2 world_T_map = simulated.world_T_vehicle().front();
  SmoothingMapper mapper({});
  double largest_m = 0.0;
  for (const model::Keyframe& keyframe : keyframes(simulated)) {
    const model::MapUpdate update = mapper.add(keyframe);
    const bool accepted = update.status == model::MapUpdateStatus::kFirstMap ||
                          update.status == model::MapUpdateStatus::kUpdated;
    REQUIRE(accepted);
    const geometry::SE2 truth =
        world_T_map.inverse() * simulated.world_T_vehicle()[8 * keyframe.sequence];
    largest_m = std::max(largest_m, distance(update.map_T_vehicle, truth));
    Eigen::LLT<Eigen::Matrix3d> llt(update.covariance + 1e-15 * Eigen::Matrix3d::Identity());
    REQUIRE(llt.info() == Eigen::Success);
  }
  CHECK(largest_m < 0.22);

  double largest_landmark_m = 0.0;
  std::vector<std::uint32_t> taken;
  for (const model::MapLandmark& landmark : mapper.landmarks()) {
    const auto nearest = simulated.grid().nearest(world_T_map * landmark.position_m);
    largest_landmark_m = std::max(largest_landmark_m, nearest->distance_m);
    taken.push_back(nearest->index);
  }
  CHECK(largest_landmark_m < 0.3);
  std::sort(taken.begin(), taken.end());
  const auto doubled = std::unique(taken.begin(), taken.end());
  REQUIRE(std::distance(doubled, taken.end()) <= 1);
}

TEST_CASE("Keyframes of another forest are not sure, and leave the map as it was", "[mapper]") {
  const sim::Drive here = drive(sim::PathKind::kLine, 30.0, 12);
  const sim::Drive there = drive(sim::PathKind::kLine, 30.0, 912);
  SmoothingMapperParameters parameters;
  parameters.new_map_keyframes = 0;  // Else they begin another map.
  SmoothingMapper mapper(parameters);
  model::Utime last = 0;

  for (const model::Keyframe& keyframe : keyframes(here)) {
    mapper.add(keyframe);
    last = keyframe.utime;
  }

  const std::vector<model::MapLandmark> landmarks = mapper.landmarks();
  const std::vector<model::KeyframePose> poses = mapper.trajectory();

  for (model::Keyframe keyframe : keyframes(there)) {
    keyframe.utime += last + 1;
    const model::MapUpdate update = mapper.add(keyframe);
    REQUIRE(update.status == model::MapUpdateStatus::kNotSure);
    REQUIRE_FALSE(update.reason.empty());
    REQUIRE(same_map(mapper, landmarks, poses));
  }
}

TEST_CASE("A keyframe that contradicts the map is rolled back exactly", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 40.0, 13);
  SmoothingMapperParameters parameters;
  parameters.outlier_chi2 = 1e9;
  SmoothingMapper mapper(parameters);
  std::vector<model::Keyframe> made = keyframes(simulated);
  model::Keyframe bent = made.back();
  made.pop_back();

  for (const model::Keyframe& keyframe : made) mapper.add(keyframe);
  const std::vector<model::MapLandmark> landmarks = mapper.landmarks();
  const std::vector<model::KeyframePose> poses = mapper.trajectory();

  // Everything is found, nothing fits.
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;

  for (model::KeyframeLandmark& landmark : bent.landmarks) {
    landmark.position_m += 0.22 * Eigen::Vector2d(normal(random), normal(random));
  }

  const model::MapUpdate update = mapper.add(bent);
  REQUIRE(update.status == model::MapUpdateStatus::kRolledBack);
  REQUIRE(same_map(mapper, landmarks, poses));

  // And the drive goes on.
  model::Keyframe good = keyframes(simulated).back();
  good.utime += 1;
  REQUIRE(mapper.add(good).status == model::MapUpdateStatus::kUpdated);
}

TEST_CASE("In a given map every keyframe finds its place, and the map is not bent", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 60.0, 14);
  SmoothingMapper mapper({});
  mapper.start_with(true_map(simulated));
  const std::vector<model::MapLandmark> given = mapper.landmarks();
  double largest_m = 0.0;
  for (model::Keyframe keyframe : keyframes(simulated)) {
    keyframe.previous_T_base.reset();  // No prior: each is searched in the whole map.
    const model::MapUpdate update = mapper.add(keyframe);
    REQUIRE(update.status == model::MapUpdateStatus::kUpdated);
    REQUIRE_FALSE(update.used_prior);
    const geometry::SE2 truth = simulated.world_T_vehicle()[8 * keyframe.sequence];
    largest_m = std::max(largest_m, distance(update.map_T_vehicle, truth));
  }
  CHECK(largest_m < 0.14);

  double largest_move_m = 0.0;
  const std::vector<model::MapLandmark> now = mapper.landmarks();
  for (std::size_t i = 0; i < given.size(); ++i)
    largest_move_m = std::max(largest_move_m, (now[i].position_m - given[i].position_m).norm());
  CHECK(largest_move_m < 0.022);
}

TEST_CASE("Localisation only leaves the given map alone", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kSquare, 60.0, 19);
  SmoothingMapperParameters parameters;
  parameters.localisation_only = true;
  SmoothingMapper mapper(parameters);
  const std::vector<model::Keyframe> made = keyframes(simulated);
  REQUIRE(mapper.add(made.front()).status == model::MapUpdateStatus::kNotSure);
  mapper.start_with(true_map(simulated));
  const std::vector<model::MapLandmark> given = mapper.landmarks();
  double largest_m = 0.0;
  double largest_nees = 0.0;
  std::size_t first_bytes = 0;

  for (std::size_t i = 1; i < made.size(); ++i) {
    const model::MapUpdate update = mapper.add(made[i]);
    if (i == 1) first_bytes = mapper.save().size();
    REQUIRE(update.status == model::MapUpdateStatus::kUpdated);
    REQUIRE(update.used_prior == (i > 1));
    const geometry::SE2 truth = simulated.world_T_vehicle()[8 * made[i].sequence];
    const Eigen::Vector3d error = (update.map_T_vehicle.inverse() * truth).Log();
    largest_m = std::max(largest_m, error.head<2>().norm());
    largest_nees = std::max(largest_nees, error.dot(update.covariance.ldlt().solve(error)));
  }

  CHECK(largest_m < 0.15);
  CHECK(largest_nees < 21.0);
  REQUIRE(mapper.trajectory().size() == made.size() - 1);
  // A pose in the trajectory, of which the oldest are forgotten some day; no node in the graph.
  CHECK(mapper.save().size() - first_bytes < 165 * (made.size() - 2));
  const std::vector<model::MapLandmark> now = mapper.landmarks();
  REQUIRE(now.size() == given.size());
  for (std::size_t i = 0; i < given.size(); ++i) REQUIRE(now[i].position_m == given[i].position_m);
}

TEST_CASE("Who follows the changed landmarks has the map", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 100.0, 21);
  SmoothingMapper mapper({});
  std::vector<model::MapLandmark> held;

  for (const model::Keyframe& keyframe : keyframes(simulated)) {
    const model::MapUpdate update = mapper.add(keyframe);
    held = with_delta(held, map_change(held, mapper.take_changed_landmarks(), update, {}));
    const std::vector<model::MapLandmark> map = mapper.landmarks();
    REQUIRE(held.size() == map.size());
    for (std::size_t i = 0; i < map.size(); ++i) {
      REQUIRE(held[i].id == map[i].id);
      // Those that are dormant, far from the vehicle, come when their node has moved by so much.
      const Eigen::Vector2d vehicle_m = update.map_T_vehicle.translation();
      const bool is_near = (map[i].position_m - vehicle_m).norm() < kAroundVehicle_m;
      if (is_near) REQUIRE(held[i].position_m == map[i].position_m);
      REQUIRE((held[i].position_m - map[i].position_m).norm() < PoseGraph::kDormantMove_m);
    }
  }
  REQUIRE(held.size() > 20);
}

TEST_CASE("A stationary vehicle does not grow the graph", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kStationary, 400.0, 15);
  SmoothingMapper mapper({});
  std::size_t after_ten = 0;
  std::size_t count = 0;
  for (const model::Keyframe& keyframe : keyframes(simulated)) {
    mapper.add(keyframe);
    if (++count == 10) after_ten = mapper.save().size();
  }
  REQUIRE(count > 50);
  REQUIRE(mapper.trajectory().size() == count);
  // What grows is one pose per keyframe in the trajectory; the map and its factors do not.
  CHECK((mapper.save().size() - after_ten) / (count - 10) < 250);
}

TEST_CASE("Scans between keyframes are located, and the map is not changed by it", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kSquare, 60.0, 16);
  const geometry::SE2 map_T_world = simulated.world_T_vehicle().front().inverse();
  keyframer::joint::JointKeyframer keyframer({});
  SmoothingMapper mapper({});
  std::size_t located = 0;
  double largest_m = 0.0;

  for (std::size_t k = 0; k < simulated.size(); ++k) {
    const model::LandmarkScan scan = simulated.scan(k).scan;
    const std::size_t before = mapper.landmarks().size();
    if (const auto pose = mapper.locate(scan)) {
      ++located;
      const geometry::SE2 truth = map_T_world * simulated.world_T_vehicle()[k];
      largest_m = std::max(largest_m, distance(pose->map_T_vehicle.mean, truth));
    }
    REQUIRE(mapper.landmarks().size() == before);
    if (const auto keyframe = keyframer.add(scan)) mapper.add(*keyframe);
  }

  REQUIRE(located >= simulated.size() - 12);
  CHECK(largest_m < 0.2);
}

TEST_CASE("The covariance of a located scan is that of its pose in the map", "[mapper]") {
  double nees = 0.0;
  int count = 0;
  for (std::uint64_t seed = 40; seed < 52; ++seed) {
    const sim::Drive simulated = drive(sim::PathKind::kLine, 120.0, seed);
    const geometry::SE2 map_T_world = simulated.world_T_vehicle().front().inverse();
    keyframer::joint::JointKeyframer keyframer({});
    SmoothingMapper mapper({});
    for (std::size_t k = 0; k < simulated.size(); ++k) {
      const model::LandmarkScan scan = simulated.scan(k).scan;
      const auto pose = mapper.locate(scan);
      if (pose && k % 20 == 0) {
        const geometry::SE2 error =
            (map_T_world * simulated.world_T_vehicle()[k]).inverse() * pose->map_T_vehicle.mean;
        nees +=
            error.coordinates().dot(pose->map_T_vehicle.covariance.inverse() * error.coordinates());
        ++count;
      }
      if (const auto keyframe = keyframer.add(scan)) mapper.add(*keyframe);
    }
  }

  REQUIRE(count > 200);

  // 3 is exact; the runs' first scans, which are common to all of a run, leave it wide.
  INFO("mean NEES " << nees / count);
  REQUIRE(nees / count > 1.2);
  REQUIRE(nees / count < 4.6);
}

TEST_CASE("A loaded mapper goes on where the saved one was", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kCircle, 40.0, 17);
  SmoothingMapper whole({});
  SmoothingMapper first({});
  SmoothingMapper second({});
  std::size_t count = 0;
  double largest = 0.0;
  for (const model::Keyframe& keyframe : keyframes(simulated)) {
    const model::MapUpdate expected = whole.add(keyframe);
    if (count == 9) second.load(first.save());
    const model::MapUpdate actual = count < 9 ? first.add(keyframe) : second.add(keyframe);
    ++count;
    REQUIRE(actual.status == expected.status);
    largest =
        std::max(largest, (actual.map_T_vehicle.inverse() * expected.map_T_vehicle).Log().norm());
    REQUIRE(actual.added == expected.added);
  }
  REQUIRE(count > 12);
  CHECK(largest < 1e-5);  // The solver's own tolerance.

  REQUIRE_THROWS(second.load("not a state"));
}

TEST_CASE("Malformed keyframes are refused with a reason", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 6.0, 18);
  std::vector<model::Keyframe> made = keyframes(simulated);
  SmoothingMapper mapper({});
  model::Keyframe empty;
  REQUIRE(mapper.add(empty).status == model::MapUpdateStatus::kRejected);
  model::Keyframe broken = made.front();
  broken.landmarks.front().position_m.x() = std::nan("");
  REQUIRE(mapper.add(broken).status == model::MapUpdateStatus::kRejected);
  REQUIRE(mapper.add(made[0]).status == model::MapUpdateStatus::kFirstMap);
  REQUIRE(mapper.add(made[0]).status == model::MapUpdateStatus::kRejected);
  REQUIRE(mapper.landmarks().size() > 20);
}

TEST_CASE("A trunk that bad scans moved and doubled is one landmark in the end", "[mapper]") {
  const sim::Drive simulated = drive(sim::PathKind::kLine, 40.0, 13, 0.05);
  std::vector<model::Keyframe> made = keyframes(simulated);
  REQUIRE(made.size() > 20);
  const geometry::SE2 centre_T_world =
      made[0].centre_T_base() * simulated.world_T_vehicle().front().inverse();

  // A trunk beside the path, far from any other.
  std::optional<Eigen::Vector2d> trunk;

  for (const Eigen::Vector2d& one : simulated.forest().trunks_m) {
    const Eigen::Vector2d position = centre_T_world * one;
    const auto others = simulated.grid().within(one, 4.0);
    if (others.size() == 1 && (position - Eigen::Vector2d(20.0, 0.0)).norm() < 15.0)
      trunk = position;
  }

  REQUIRE(trunk);
  SmoothingMapper mapper({});
  std::size_t doubled = 0;

  for (std::size_t k = 0; k < made.size(); ++k) {
    const double driven = 1.6 * static_cast<double>(k);
    model::Keyframe& keyframe = made[k];
    for (std::size_t i = 0; k >= 8 && k < 18 && i < keyframe.landmarks.size(); ++i) {
      const Eigen::Vector2d from_start =
          keyframe.landmarks[i].position_m + Eigen::Vector2d(driven, 0.0);
      if ((from_start - *trunk).norm() > 1.0) continue;
      model::KeyframeLandmark moved = keyframe.landmarks[i];
      moved.position_m.y() += 0.8;
      if (k == 14) {
        keyframe.landmarks.push_back(moved);
        ++doubled;
      } else {
        keyframe.landmarks[i] = moved;
      }
      break;
    }
    mapper.add(keyframe);
  }

  REQUIRE(doubled == 1);
  std::size_t near = 0;
  const geometry::SE2 map_T_centre =
      mapper.trajectory().front().map_T_vehicle * made[0].centre_T_base().inverse();

  for (const model::MapLandmark& landmark : mapper.landmarks()) {
    if ((landmark.position_m - map_T_centre * *trunk).norm() < 1.5) ++near;
  }
  CHECK(near == 1);
}

TEST_CASE(
    "Where landmarks end a scan's pose is by odometry, as uncertain as that, until they return",
    "[mapper]") {
  double nees = 0.0;
  int coasted = 0;
  for (std::uint64_t seed = 70; seed < 90; ++seed) {
    const sim::Drive simulated = drive(sim::PathKind::kLine, 60.0, seed);
    const geometry::SE2 map_T_world = simulated.world_T_vehicle().front().inverse();
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    keyframer::joint::JointKeyframer keyframer({});
    SmoothingMapperParameters parameters;
    parameters.use_odometry = true;
    SmoothingMapper mapper(parameters);
    double sigma_m = 0.0;

    for (std::size_t k = 0; k < simulated.size(); ++k) {
      model::LandmarkScan scan = simulated.scan(k).scan;
      const bool is_dark = k >= 100 && k < 140;
      if (is_dark) scan.detections.clear();
      if (k > 0) {
        model::Odometry motion;
        motion.from_utime = simulated.utime(k - 1);
        motion.utime = simulated.utime(k);
        motion.from_T_to =
            simulated.world_T_vehicle()[k - 1].inverse() * simulated.world_T_vehicle()[k] *
            geometry::SE2(0.01 * normal(random), 0.01 * normal(random), 1e-3 * normal(random));
        motion.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal();
        motion.has_wheels = true;
        mapper.add(motion);
      }

      const auto pose = mapper.locate(scan);
      if (k > 20) {
        REQUIRE(pose);
        REQUIRE(pose->is_coasting == is_dark);
      }
      if (is_dark) {
        const double now_m =
            std::sqrt(pose->map_T_vehicle.covariance.topLeftCorner<2, 2>().trace());
        CHECK(now_m > sigma_m);
        sigma_m = now_m;
      }
      if (k == 139) {
        const Eigen::Vector3d error =
            (pose->map_T_vehicle.mean.inverse() * map_T_world * simulated.world_T_vehicle()[k])
                .Log();
        nees += error.dot(pose->map_T_vehicle.covariance.inverse() * error);
        ++coasted;
      }
      if (is_dark) continue;
      if (const auto keyframe = keyframer.add(scan)) mapper.add(*keyframe);
    }
  }
  INFO("mean NEES " << nees / coasted);
  CHECK(nees / coasted < 5.0);
  CHECK(nees / coasted > 1.2);
}
