// A drive that begins in a map which somebody made before.
#include <Eigen/Cholesky>
#include <filesystem>
#include <memory>

#include "common/bus/memory_bus.hpp"
#include "common/map_file/map_file.hpp"
#include "common/model/slam_output.hpp"
#include "common/state/archive.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/geoslam_mapper/given_map.hpp"
#include "services/geoslam_mapper/point_covariance.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"
#include "understory/health_t.hpp"
#include "understory/map_request_t.hpp"

using namespace understory;
using Catch::Matchers::Contains;

namespace {

constexpr double kSurveySigma_m = 0.02;

sim::Drive drive_through(std::uint64_t seed, double length_m = 60.0) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = length_m;
  return {parameters, seed};
}

/// Every trunk of the drive's forest, surveyed; frame world, map 7.
std::vector<model::MapLandmark> survey(const sim::Drive& drive, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> error(0.0, kSurveySigma_m);
  std::vector<model::MapLandmark> result;
  for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
    model::MapLandmark one;
    one.id = map_file::landmark_id(7, result.size() + 1);
    one.position_m = trunk + Eigen::Vector2d(error(random), error(random));
    one.covariance_m2 = kSurveySigma_m * kSurveySigma_m * Eigen::Matrix2d::Identity();
    result.push_back(one);
  }
  return result;
}

/// A file with this map as number 7, and an empty one as number 8 where `has_two`.
std::filesystem::path file_of(const std::vector<model::MapLandmark>& landmarks,
                              const test::TemporaryDirectory& folder, bool has_two = false,
                              std::vector<model::KeyframePose> keyframes = {}) {
  map_file::StoredMap map;
  map.map_id = 7;
  map.keyframes = std::move(keyframes);
  for (const model::MapLandmark& one : landmarks) map.landmarks.push_back({one, {}, {}});
  std::vector<map_file::StoredMap> maps{map};
  if (has_two) maps.emplace_back().map_id = 8;
  const std::filesystem::path file = folder.path() / "survey.gpkg";
  map_file::create_map_file(file, maps, {0, "test", "", "surveyed"});
  return file;
}

std::string toml_of(const std::filesystem::path& file, bool localisation_only) {
  return "[input]\nmap_file = \"" + file.string() +
         "\"\n[smoothing]\nlocalisation_only = " + (localisation_only ? "true" : "false") + "\n";
}

/// Keyframer and mapper on one bus, and what they say.
class Stack {
 public:
  explicit Stack(const std::string& mapper_toml) {
    host(keyframer::keyframer_service(), "");
    host(geoslam_mapper::geoslam_mapper_service(), mapper_toml);
  }

  template <class Message>
  void feed(const std::string& channel, const Message& message) {
    bus_.publish(channel, wire::encode_message(message));
    bus_.drain();
    hosted_.back()->node().publish_health();
    bus_.drain();
  }
  void drive(const sim::Drive& drive) {
    for (std::size_t k = 0; k < drive.size(); ++k) feed("LANDMARKS", drive.scan(k).scan);
  }
  model::WholeMap asked() {
    map_request_t request{};
    request.everything = 1;
    feed("MAP_REQUEST", request);
    return *map;
  }

  std::vector<model::SlamPose> poses;
  std::vector<model::MapUpdate> updates;
  std::optional<model::WholeMap> map;
  std::optional<model::Utime> lost_since;  ///< First HEALTH of the mapper that says so.
  int refused_maps = 0;

 private:
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }
  void hear(const bus::BusMessage& message) {
    if (message.channel == "SLAM_POSE") {
      poses.push_back(wire::decode_message<model::SlamPose>(message.bytes).value());
    } else if (message.channel == "SLAM_UPDATE") {
      updates.push_back(wire::decode_message<model::MapUpdate>(message.bytes).value());
    } else if (message.channel == "MAP") {
      map = wire::decode_message<model::WholeMap>(message.bytes).value();
    } else if (message.channel == "HEALTH") {
      hear_health(message);
    }
  }
  void hear_health(const bus::BusMessage& message) {
    health_t health;
    REQUIRE(health.decode(message.bytes.data(), 0, static_cast<int>(message.bytes.size())) > 0);
    if (health.process != "geoslam_mapper") return;
    for (const reason_count_t& reason : health.reasons) {
      if (reason.reason == "lost" && !lost_since) lost_since = health.message_utime;
      if (reason.reason == "input_refused") refused_maps = 1;
    }
  }

  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited,
                      [this](const bus::BusMessage& message) { hear(message); }};
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

/// RMS of the localised poses [m], and their mean NEES; all must be in map 7.
std::pair<double, double> errors(const Stack& stack, const sim::Drive& drive) {
  double squared = 0.0;
  double nees = 0.0;
  double count = 0.0;
  for (const model::SlamPose& pose : stack.poses) {
    if (!pose.is_localised()) continue;
    REQUIRE(pose.map_id == 7);
    std::size_t k = 0;
    while (drive.utime(k) < pose.utime) ++k;
    const Eigen::Vector3d error =
        (drive.world_T_vehicle()[k].inverse() * pose.map_T_vehicle()).Log();
    squared += error.head<2>().squaredNorm();
    nees += error.dot(pose.covariance.ldlt().solve(error));
    count += 1.0;
  }
  REQUIRE(count > 0.95 * static_cast<double>(drive.size()));
  return {std::sqrt(squared / count), nees / count};
}

}  // namespace

TEST_CASE("A drive begins anywhere in a surveyed map, and leaves it as it is", "[given_map]") {
  for (std::uint64_t seed = 50; seed < 54; ++seed) {
    CAPTURE(seed);
    const test::TemporaryDirectory folder;
    const sim::Drive drive = drive_through(seed);
    const std::vector<model::MapLandmark> surveyed = survey(drive, seed);
    Stack stack(toml_of(file_of(surveyed, folder), true));
    stack.drive(drive);

    const auto [rms_m, nees] = errors(stack, drive);
    CHECK(rms_m < 0.15);
    CHECK(nees < 6.0);
    CHECK(stack.updates.front().status == model::MapUpdateStatus::kUpdated);
    CHECK_FALSE(stack.updates.front().used_prior);
    CHECK_FALSE(stack.lost_since);

    const model::WholeMap after = stack.asked();
    REQUIRE(after.landmarks.size() == surveyed.size());
    for (std::size_t i = 0; i < surveyed.size(); ++i) {
      CHECK(after.landmarks[i].id == surveyed[i].id);
      CHECK(after.landmarks[i].position_m == surveyed[i].position_m);
      CHECK(after.landmarks[i].covariance_m2 == surveyed[i].covariance_m2);
    }
  }
}

TEST_CASE("The map of an earlier drive is driven in without doubling its landmarks",
          "[given_map]") {
  for (std::uint64_t seed = 54; seed < 57; ++seed) {
    CAPTURE(seed);
    const test::TemporaryDirectory folder;
    const sim::Drive drive = drive_through(seed, 200.0);
    // Far from its origin all of a drive's landmarks are uncertain, mostly by the same.
    std::vector<model::MapLandmark> landmarks = survey(drive, seed);
    for (model::MapLandmark& one : landmarks)
      one.covariance_m2 = 0.1 * 0.1 * Eigen::Matrix2d::Identity();
    Stack stack(toml_of(file_of(landmarks, folder), false));
    stack.drive(drive);

    const auto [rms_m, nees] = errors(stack, drive);
    CHECK(rms_m < 0.15);
    CHECK(stack.asked().landmarks.size() <= landmarks.size() + landmarks.size() / 100);
  }
}

TEST_CASE("What a map's landmarks share far from its first keyframe is no error of each",
          "[given_map]") {
  const test::TemporaryDirectory folder;
  const sim::Drive drive = drive_through(58, 200.0);
  // As after 200 m: a heading of the whole map that is known to 4 mrad, 200 m before the drive.
  const geometry::SE2WithCovariance world_T_first{
      geometry::SE2({-200.0, 0.0}, 0.0),
      Eigen::Vector3d(1e-4, 1e-4, 4e-3 * 4e-3).asDiagonal().toDenseMatrix()};
  std::vector<model::MapLandmark> landmarks = survey(drive, 58);
  for (model::MapLandmark& one : landmarks) {
    one.covariance_m2 += geoslam_mapper::point_covariance(
        world_T_first, world_T_first.mean.inverse() * one.position_m);
  }
  std::vector<model::KeyframePose> keyframes;
  for (std::size_t k = 0; k < drive.size(); k += 10) {
    const geometry::SE2 pose = drive.world_T_vehicle()[k];
    const geometry::SE2WithCovariance first_T_vehicle{world_T_first.mean.inverse() * pose,
                                                      Eigen::Matrix3d::Zero()};
    const auto stated = compound(world_T_first, first_T_vehicle);
    keyframes.push_back({k + 1, drive.utime(k), pose, stated.covariance});
  }

  SECTION("alone, they are as the survey left them") {
    const model::WholeMap map{0, 0, 0, true, landmarks, keyframes};
    for (const model::MapLandmark& one : geoslam_mapper::apart_from_keyframes(map, 0.01)) {
      CHECK(one.covariance_m2(0, 0) < 1.1 * kSurveySigma_m * kSurveySigma_m);
      CHECK(one.covariance_m2(1, 1) < 1.1 * kSurveySigma_m * kSurveySigma_m);
      CHECK(one.covariance_m2.determinant() > 0.0);
    }
    // Keyframes that cannot be tell nothing.
    model::WholeMap spoiled = map;
    for (std::size_t i = 0; i < keyframes.size(); ++i)
      spoiled.keyframes[i].covariance *= i % 2 == 0 ? std::nan("") : -1.0;
    spoiled.keyframes.front() = {1, 0, geometry::SE2({std::nan(""), 0.0}, 0.0),
                                 Eigen::Matrix3d::Identity()};
    CHECK(geoslam_mapper::apart_from_keyframes(spoiled, 0.01)[0].covariance_m2 ==
          landmarks[0].covariance_m2);
    // Nor does anybody know without keyframes what is shared.
    const model::WholeMap surveyed{0, 0, 0, true, landmarks, {}};
    CHECK(geoslam_mapper::apart_from_keyframes(surveyed, 0.01)[0].covariance_m2 ==
          landmarks[0].covariance_m2);
  }
  SECTION("driven in, none is doubled") {
    Stack stack(toml_of(file_of(landmarks, folder, false, keyframes), false));
    stack.drive(drive);
    const auto [rms_m, nees] = errors(stack, drive);
    CHECK(rms_m < 0.05);
    CHECK(stack.asked().landmarks.size() <= landmarks.size() + landmarks.size() / 100);
  }
}

TEST_CASE("Poses in a map that was driven state the error of that map", "[given_map]") {
  const sim::Drive drive = drive_through(59, 120.0);
  // The map is rotated about a place 200 m before it; what is seen in it does not show that.
  const geometry::SE2 first({-200.0, 0.0}, 0.0);
  const double sigma_rad = 4e-3;
  double nees = 0.0;
  for (const double error_rad : {-1.0 * sigma_rad, 0.5 * sigma_rad, 1.2 * sigma_rad}) {
    const geometry::SE2 map_T_world =
        first * geometry::SE2({0.0, 0.0}, error_rad) * first.inverse();
    const geometry::SE2WithCovariance map_T_first{
        first, Eigen::Vector3d(1e-4, 1e-4, sigma_rad * sigma_rad).asDiagonal().toDenseMatrix()};
    std::vector<model::MapLandmark> landmarks = survey(drive, 59);
    for (model::MapLandmark& one : landmarks) {
      one.position_m = map_T_world * one.position_m;
      one.covariance_m2 += geoslam_mapper::point_covariance(
          map_T_first, map_T_first.mean.inverse() * one.position_m);
    }
    std::vector<model::KeyframePose> keyframes;
    for (std::size_t k = 0; k < drive.size(); k += 10) {
      const geometry::SE2 pose = map_T_world * drive.world_T_vehicle()[k];
      const auto stated =
          compound(map_T_first,
                   geometry::SE2WithCovariance{first.inverse() * pose, Eigen::Matrix3d::Zero()});
      keyframes.push_back({k + 1, drive.utime(k), pose, stated.covariance});
    }
    const test::TemporaryDirectory folder;
    Stack stack(toml_of(file_of(landmarks, folder, false, keyframes), false));
    stack.drive(drive);
    nees += errors(stack, drive).second / 3.0;
    for (const model::KeyframePose& one : stack.asked().keyframes) {
      const double lever_m = (one.map_T_vehicle.translation() - first.translation()).norm();
      CHECK(one.covariance.topLeftCorner<2, 2>().trace() > 0.8 * std::pow(lever_m * sigma_rad, 2));
      CHECK(one.covariance(2, 2) >= sigma_rad * sigma_rad);
    }
  }
  // The heading's error alone: its square over its variance is 0.9 in the mean of the three.
  CHECK(nees > 0.3);
  CHECK(nees < 3.0);
}

TEST_CASE("The frame of a given map is that of its nearest keyframe, after a restart as well",
          "[given_map]") {
  std::mt19937_64 random(60);
  std::uniform_real_distribution<double> place(-2000.0, 2000.0);
  model::WholeMap map;
  map.landmarks.resize(1);
  map.landmarks[0].id = (model::LandmarkId{7} << model::kLandmarkCounterBits) | 1U;
  for (std::uint64_t k = 0; k < 300; ++k) {
    const geometry::SE2 pose({place(random), place(random)}, place(random));
    map.keyframes.push_back({k, static_cast<model::Utime>(k), pose,
                             1e-4 * static_cast<double>(k + 1) * Eigen::Matrix3d::Identity()});
  }
  const geoslam_mapper::GivenFrame frame(map);
  geoslam_mapper::GivenFrame loaded;
  state::load(state::save({"test"}, frame), {"test"}, loaded);
  loaded.rebuild();
  CHECK(loaded.map_id() == 7);

  for (int i = 0; i < 300; ++i) {
    const geometry::SE2 pose({1.2 * place(random), place(random)}, 0.0);
    const auto nearest = std::ranges::min_element(map.keyframes, {}, [&](const auto& one) {
      return (one.map_T_vehicle.translation() - pose.translation()).norm();
    });
    const auto expected =
        compound(geometry::SE2WithCovariance{nearest->map_T_vehicle, nearest->covariance},
                 geometry::SE2WithCovariance{nearest->map_T_vehicle.inverse() * pose,
                                             Eigen::Matrix3d::Zero()});
    const double size = expected.covariance.norm();
    CHECK((frame.covariance_at(pose) - expected.covariance).norm() <= 1e-9 * size);
    CHECK((loaded.covariance_at(pose) - expected.covariance).norm() <= 1e-9 * size);
  }
  CHECK(geoslam_mapper::GivenFrame().covariance_at({}).isZero(0.0));
}

TEST_CASE("In somebody else's map the mapper says that it is lost, within 2 s", "[given_map]") {
  for (const bool localisation_only : {true, false}) {
    for (std::uint64_t seed = 60; seed < 64; ++seed) {
      CAPTURE(seed, localisation_only);
      const test::TemporaryDirectory folder;
      const sim::Drive drive = drive_through(seed);
      const auto foreign = survey(drive_through(seed + 100, 10.0), seed);
      Stack stack(toml_of(file_of(foreign, folder), localisation_only));
      stack.drive(drive);

      for (const model::SlamPose& pose : stack.poses)
        CHECK((!pose.is_localised() || (pose.map_id == 8 && !localisation_only)));
      REQUIRE(stack.lost_since);
      CHECK(*stack.lost_since - drive.utime(0) <= 2'000'000);
      // Who may map begins another map.
      CHECK((stack.asked().landmarks.front().id >> model::kLandmarkCounterBits) ==
            (localisation_only ? 7U : 8U));
    }
  }
}

TEST_CASE("A map that is wrong and certain of it is left for one that keyframes agree on",
          "[given_map]") {
  for (std::uint64_t seed = 80; seed < 84; ++seed) {
    CAPTURE(seed);
    const test::TemporaryDirectory folder;
    const sim::Drive drive = drive_through(seed, 120.0);
    std::vector<model::MapLandmark> wrong = survey(drive, seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> error(0.0, 0.25);
    for (model::MapLandmark& one : wrong) {
      one.position_m += Eigen::Vector2d(error(random), error(random));
      one.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    }
    Stack stack(toml_of(file_of(wrong, folder), false));
    stack.drive(drive);

    int in_row = 0;
    int longest = 0;
    for (const model::MapUpdate& update : stack.updates) {
      in_row = update.status == model::MapUpdateStatus::kRolledBack ? in_row + 1 : 0;
      longest = std::max(longest, in_row);
    }
    CHECK(longest <= 12);
    CHECK(stack.updates.back().status == model::MapUpdateStatus::kUpdated);
  }
}

TEST_CASE("A given map by message is taken in the beginning alone, and grows", "[given_map]") {
  const sim::Drive drive = drive_through(70);
  std::vector<model::MapLandmark> half = survey(drive, 70);
  std::erase_if(half, [](const model::MapLandmark& one) { return one.id % 2 == 0; });
  model::WholeMap given;
  given.landmarks = half;
  given.utime = 5'000'000'000;  // another day
  Stack stack("");

  SECTION("whole") {
    stack.feed("GIVEN_MAP", given);
    stack.drive(drive);
    const auto [rms_m, nees] = errors(stack, drive);
    CHECK(rms_m < 0.15);
    CHECK(nees < 6.0);
    const model::WholeMap after = stack.asked();
    CHECK(after.landmarks.size() > half.size());
    CHECK(after.landmarks.back().id > half.back().id);
    CHECK(model::map_of(after.landmarks.back().id) == 7);
    CHECK(stack.refused_maps == 0);
  }
  SECTION("when there is one") {
    for (std::size_t k = 0; k < 20; ++k) stack.feed("LANDMARKS", drive.scan(k).scan);
    stack.feed("GIVEN_MAP", given);
    CHECK(stack.refused_maps == 1);
    CHECK(model::map_of(stack.asked().landmarks.front().id) == 1);
  }
}

TEST_CASE("A message that is no map to begin with is refused with the reason", "[given_map]") {
  model::WholeMap map;
  map.landmarks = survey(drive_through(71, 10.0), 71);
  map.landmarks.resize(5);
  CHECK(geoslam_mapper::why_not_given(map).empty());

  model::WholeMap cut = map;
  cut.complete = false;
  CHECK_THAT(geoslam_mapper::why_not_given(cut), Contains("cut"));
  model::WholeMap empty = map;
  empty.landmarks.clear();
  CHECK_THAT(geoslam_mapper::why_not_given(empty), Contains("no landmark"));
  model::WholeMap mixed = map;
  mixed.landmarks.back().id = map_file::landmark_id(8, 1);
  CHECK(geoslam_mapper::why_not_given(mixed).empty());  // A map that another one became part of.
  model::WholeMap twice = map;
  twice.landmarks[1].id = twice.landmarks[0].id;
  CHECK_THAT(geoslam_mapper::why_not_given(twice), Contains("ascend"));
  model::WholeMap impossible = map;
  impossible.landmarks[2].covariance_m2 << 1.0, 2.0, 2.0, 1.0;
  CHECK_THAT(geoslam_mapper::why_not_given(impossible), Contains("cannot be"));
  impossible.landmarks[2].covariance_m2.setConstant(std::nan(""));
  CHECK_THAT(geoslam_mapper::why_not_given(impossible), Contains("cannot be"));
}

TEST_CASE("A map file that cannot be begun with is named", "[given_map]") {
  const test::TemporaryDirectory folder;
  CHECK_THROWS_WITH(geoslam_mapper::read_given_map((folder.path() / "none.gpkg").string(), 0),
                    Contains("none.gpkg"));
  const auto file = file_of(survey(drive_through(72, 10.0), 72), folder, true).string();
  // Map 8 has no landmark, as the trajectory of a merged map.
  CHECK(geoslam_mapper::read_given_map(file, 0).landmarks.size() > 100);
  CHECK_THROWS_WITH(geoslam_mapper::read_given_map(file, 3), Contains("input.map_id is 3"));
  CHECK_THROWS_WITH(geoslam_mapper::read_given_map(file, 8), Contains("map 8 has no landmark"));
  CHECK(geoslam_mapper::read_given_map(file, 7).landmarks.size() > 100);

  map_file::MapFile opened(file, map_file::Access::kWrite);
  map_file::StoredMap second = opened.read(8);
  second.landmarks.emplace_back();
  second.landmarks.back().landmark.id = map_file::landmark_id(8, 1);
  opened.put({&second, 1}, {});
  { const map_file::MapFile closed = std::move(opened); }
  CHECK_THROWS_WITH(geoslam_mapper::read_given_map(file, 0), Contains("map 7, 8; say which one"));
}
