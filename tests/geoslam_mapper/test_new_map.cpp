// Who is lost begins another map; the one before stays as it was.
#include <Eigen/Cholesky>
#include <random>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr std::size_t kScansPerKeyframe = 8;

sim::Drive walk(std::uint64_t seed, double length_m) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.length_m = length_m;
  return {parameters, seed};
}

/// Keyframes of a drive, all `late_us` later.
std::vector<model::Keyframe> keyframes_of(const sim::Drive& drive, model::Utime late_us = 0) {
  keyframer::joint::JointKeyframer keyframer({});
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    model::LandmarkScan scan = drive.scan(k).scan;
    scan.utime += late_us;
    if (auto keyframe = keyframer.add(scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

/// Keyframes of one scan, metres apart: every eighth scan of a drive.
std::vector<model::Keyframe> keyframes_of_one_scan(const sim::Drive& drive, model::Utime late_us) {
  keyframer::JointKeyframerParameters parameters;
  parameters.observations_per_keyframe = 1;
  parameters.min_observations = 1;
  keyframer::joint::JointKeyframer keyframer(parameters);
  std::vector<model::Keyframe> result;
  for (std::size_t k = 0; k < drive.size(); k += kScansPerKeyframe) {
    model::LandmarkScan scan = drive.scan(k).scan;
    scan.utime += late_us;
    if (auto keyframe = keyframer.add(scan)) result.push_back(std::move(*keyframe));
  }
  return result;
}

const geometry::SE2& truth_of(const model::Keyframe& keyframe, const sim::Drive& drive) {
  return drive.world_T_vehicle()[kScansPerKeyframe * keyframe.sequence];
}

bool is_placed(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

double nees(const model::MapUpdate& update, const geometry::SE2& map_T_vehicle) {
  const Eigen::Vector3d error = (map_T_vehicle.inverse() * update.map_T_vehicle).Log();
  return error.dot(update.covariance.ldlt().solve(error));
}

/// Motion between two keyframes' bases, and through the scans of the later one.
std::vector<model::Odometry> odometry_to(const model::Keyframe& keyframe, model::Utime from_utime,
                                         const geometry::SE2& from_T_base, double sigma_m,
                                         double sigma_rad) {
  std::vector<model::Odometry> result;
  model::Odometry motion;
  motion.has_wheels = true;
  motion.covariance =
      Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  motion.from_utime = from_utime;
  motion.utime = keyframe.utime;
  motion.from_T_to = from_T_base;
  result.push_back(motion);
  const model::KeyframeMember& last = keyframe.members.back();
  motion.from_utime = keyframe.utime;
  motion.utime = last.utime;
  motion.from_T_to = keyframe.centre_T_base().inverse() * last.centre_T_vehicle;
  motion.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal();
  result.push_back(motion);
  return result;
}

/// The same keyframe among landmarks that nobody has seen.
model::Keyframe among_strangers(model::Keyframe keyframe, std::mt19937_64& random) {
  std::uniform_real_distribution<double> anywhere(-35.0, 35.0);
  for (model::KeyframeLandmark& landmark : keyframe.landmarks)
    landmark.position_m = {anywhere(random), anywhere(random)};
  return keyframe;
}

/// A mapper with odometry that is fed keyframe by keyframe of one drive.
struct Drivable {
  sim::Drive drive;
  std::vector<model::Keyframe> keyframes = keyframes_of(drive);
  SmoothingMapper mapper;
  std::optional<model::Keyframe> last;

  Drivable(std::uint64_t seed, const SmoothingMapperParameters& parameters)
      : drive(walk(seed, 60.0)), mapper(parameters) {}

  model::MapUpdate add(const model::Keyframe& keyframe, double sigma_m = 0.02,
                       double sigma_rad = 0.002) {
    if (last && sigma_m > 0.0) {
      const std::size_t at = kScansPerKeyframe * last->sequence + last->members.size() - 1;
      const geometry::SE2 motion =
          drive.world_T_vehicle()[at].inverse() * truth_of(keyframe, drive);
      for (const model::Odometry& one :
           odometry_to(keyframe, last->members.back().utime, motion, sigma_m, sigma_rad))
        mapper.add(one);
    }
    last = keyframe;
    return mapper.add(keyframe);
  }
};

SmoothingMapperParameters with_odometry() {
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  return parameters;
}

}  // namespace

TEST_CASE("Who is lost and sees landmarks is in a new map after three keyframes", "[new_map]") {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t seed = 300; seed < 312; ++seed) {
    const sim::Drive here = walk(seed, 40.0);
    const sim::Drive there = walk(seed + 1000, 60.0);
    SmoothingMapper mapper({});
    for (const model::Keyframe& keyframe : keyframes_of(here))
      REQUIRE(is_placed(mapper.add(keyframe)));
    const std::vector<model::MapLandmark> landmarks = mapper.landmarks();
    const std::vector<model::KeyframePose> trajectory = mapper.trajectory();

    // Landmarks ended for a minute; then another place.
    std::optional<geometry::SE2> map_T_world;
    int waited = 0;
    for (const model::Keyframe& keyframe :
         keyframes_of(there, here.utime(here.size() - 1) + 60'000'000)) {
      const model::MapUpdate update = mapper.add(keyframe);
      if (!map_T_world && !is_placed(update)) {
        ++waited;
        CHECK(update.is_lost);
        CHECK(update.map_id == 1);
        continue;
      }
      REQUIRE(is_placed(update));
      CHECK(update.map_id == 2);
      if (!map_T_world) {
        CHECK(update.status == model::MapUpdateStatus::kFirstMap);
        CHECK(update.added.size() == mapper.landmarks().size());
        map_T_world =
            mapper.trajectory().front().map_T_vehicle * there.world_T_vehicle().front().inverse();
      }
      const geometry::SE2 truth = *map_T_world * truth_of(keyframe, there);
      CHECK((truth.inverse() * update.map_T_vehicle).translation().norm() < 0.4);
      if (keyframe.sequence % 6 != 5) continue;
      sum += nees(update, truth);
      ++count;
    }
    CHECK(waited == 2);
    for (const model::MapLandmark& landmark : mapper.landmarks())
      CHECK(model::map_of(landmark.id) == 2);

    // The map that was left.
    REQUIRE(mapper.kept_maps().maps().size() == 1);
    const KeptMap& kept = mapper.kept_maps().maps().front();
    CHECK(kept.id == 1);
    REQUIRE(kept.landmarks.size() == landmarks.size());
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      CHECK(kept.landmarks[i].id == landmarks[i].id);
      CHECK(kept.landmarks[i].position_m == landmarks[i].position_m);
      CHECK(Eigen::LLT<Eigen::Matrix2d>(kept.landmarks[i].covariance_m2).info() == Eigen::Success);
    }
    REQUIRE(kept.keyframes.size() == trajectory.size());
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      CHECK(kept.keyframes[i].map_T_vehicle.coordinates() ==
            trajectory[i].map_T_vehicle.coordinates());
    }
    CHECK_FALSE(kept.whole.empty());
  }
  CAPTURE(sum / count);
  CHECK(count > 40);
  CHECK(sum / count > 1.2);
  CHECK(sum / count < 4.6);
}

TEST_CASE("While odometry reaches back to the map, it places what matches nothing", "[new_map]") {
  for (std::uint64_t seed = 320; seed < 328; ++seed) {
    Drivable driven(seed, with_odometry());
    std::mt19937_64 random(seed);
    for (std::size_t k = 0; k < driven.keyframes.size(); ++k) {
      const bool is_strange = k >= 12 && k < 20;
      const model::MapUpdate update = driven.add(
          is_strange ? among_strangers(driven.keyframes[k], random) : driven.keyframes[k]);
      CHECK(is_placed(update));
      CHECK_FALSE(update.is_lost);
      CHECK(update.map_id == 1);

      // Right to within what is stated, from the first keyframe on.
      const geometry::SE2 truth = truth_of(driven.keyframes.front(), driven.drive).inverse() *
                                  truth_of(driven.keyframes[k], driven.drive);
      if (k > 0) CHECK(nees(update, truth) < 25.0);
    }
    CHECK(driven.mapper.kept_maps().maps().empty());
  }
}

TEST_CASE("Odometry with a gap, or too uncertain, does not keep anyone in a map", "[new_map]") {
  const double bad_sigma_m = GENERATE(0.0, 12.0);  // 0: a gap.
  for (std::uint64_t seed = 330; seed < 334; ++seed) {
    Drivable driven(seed, with_odometry());
    for (std::size_t k = 0; k < 15; ++k) REQUIRE(is_placed(driven.add(driven.keyframes[k])));

    // Carried away: what it drives through next is another forest.
    const sim::Drive there = walk(seed + 1000, 40.0);
    const model::Utime late_us = driven.drive.utime(driven.drive.size() - 1) + 1'000'000;
    std::vector<model::MapUpdate> updates;
    std::optional<model::Keyframe> last = driven.last;
    for (const model::Keyframe& keyframe : keyframes_of(there, late_us)) {
      const bool is_first = updates.empty();
      const geometry::SE2 motion =
          is_first ? geometry::SE2()
                   : there.world_T_vehicle()[kScansPerKeyframe * keyframe.sequence - 1].inverse() *
                         truth_of(keyframe, there);
      const double sigma_m = is_first ? bad_sigma_m : 0.02;
      auto motions = odometry_to(keyframe, last->members.back().utime, motion, sigma_m, 0.002);
      if (sigma_m == 0.0) motions.erase(motions.begin());
      for (const model::Odometry& one : motions) driven.mapper.add(one);
      updates.push_back(driven.mapper.add(keyframe));
      last = keyframe;
    }
    REQUIRE(updates.size() > 8);
    CHECK(updates[1].is_lost);
    CHECK(updates[2].status == model::MapUpdateStatus::kFirstMap);
    CHECK(updates.back().map_id == 2);
    CHECK(is_placed(updates.back()));
  }
}

TEST_CASE("A new map begins as well where a landmark needs two keyframes", "[new_map]") {
  SmoothingMapperParameters parameters = with_odometry();
  parameters.min_observations = 2;
  parameters.min_matched = 3;

  for (std::uint64_t seed = 370; seed < 376; ++seed) {
    SmoothingMapper mapper(parameters);
    std::vector<model::MapUpdate> updates;
    model::Utime late_us = 0;
    for (const sim::Drive& drive : {walk(seed, 60.0), walk(seed + 1000, 60.0)}) {
      // No odometry leads from the one to the other.
      std::optional<model::Keyframe> last;
      for (const model::Keyframe& keyframe : keyframes_of_one_scan(drive, late_us)) {
        if (last) {
          const geometry::SE2 motion = truth_of(*last, drive).inverse() * truth_of(keyframe, drive);
          mapper.add(odometry_to(keyframe, last->utime, motion, 0.02, 0.002).front());
        }
        updates.push_back(mapper.add(keyframe));
        last = keyframe;
      }
      CHECK(is_placed(updates.back()));
      late_us = last->utime + 60'000'000;
    }

    CHECK(updates.back().map_id == 2);
    CHECK(mapper.kept_maps().maps().size() == 1);
  }
}

TEST_CASE("Who only localises never begins a map, nor who is told not to", "[new_map]") {
  const sim::Drive here = walk(340, 30.0);
  const sim::Drive there = walk(1340, 30.0);
  SmoothingMapperParameters parameters;
  SECTION("localisation only") { parameters.localisation_only = true; }
  SECTION("told not to") { parameters.new_map_keyframes = 0; }
  SmoothingMapper mapper(parameters);
  std::vector<model::MapLandmark> given;
  for (const Eigen::Vector2d& trunk : here.forest().trunks_m)
    given.emplace_back().position_m = trunk;
  mapper.start_with(given);
  for (const model::Keyframe& keyframe : keyframes_of(there)) {
    const model::MapUpdate update = mapper.add(keyframe);
    CHECK(update.status == model::MapUpdateStatus::kNotSure);
    CHECK(update.map_id == 1);
  }
  CHECK(mapper.kept_maps().maps().empty());
}

TEST_CASE("Keyframes that do not agree with each other begin no map", "[new_map]") {
  const std::vector<model::Keyframe> here = keyframes_of(walk(350, 60.0));
  SmoothingMapper mapper({});
  std::mt19937_64 random(350);
  for (std::size_t k = 0; k < here.size(); ++k) {
    const bool is_strange = k >= 10 && k < 25;
    const model::MapUpdate update =
        mapper.add(is_strange ? among_strangers(here[k], random) : here[k]);
    if (is_strange) CHECK(update.status == model::MapUpdateStatus::kNotSure);
    CHECK(update.map_id == 1);
  }
  CHECK(is_placed(mapper.add([&] {
    model::Keyframe again = here.back();
    again.utime += 1'000'000;
    return again;
  }())));
}

TEST_CASE("A mapper that is loaded while it tries another map goes on with it", "[new_map]") {
  const std::vector<model::Keyframe> here = keyframes_of(walk(360, 30.0));
  const std::vector<model::Keyframe> there =
      keyframes_of(walk(1360, 30.0), here.back().utime + 1'000'000);
  for (std::size_t at = 0; at < 5; ++at) {
    SmoothingMapper whole({});
    auto broken = std::make_unique<SmoothingMapper>(SmoothingMapperParameters{});
    for (const model::Keyframe& keyframe : here) {
      whole.add(keyframe);
      broken->add(keyframe);
    }
    for (std::size_t k = 0; k < there.size(); ++k) {
      if (k == at) {
        const std::string state = broken->save();
        broken = std::make_unique<SmoothingMapper>(SmoothingMapperParameters{});
        broken->load(state);
      }
      const model::MapUpdate expected = whole.add(there[k]);
      const model::MapUpdate actual = broken->add(there[k]);
      REQUIRE(actual.status == expected.status);
      REQUIRE(actual.map_id == expected.map_id);
      CHECK((actual.map_T_vehicle.inverse() * expected.map_T_vehicle).Log().norm() < 1e-4);
    }
    REQUIRE(broken->kept_maps().maps().size() == 1);
    CHECK(broken->kept_maps().maps()[0].landmarks.size() ==
          whole.kept_maps().maps()[0].landmarks.size());
  }
}

TEST_CASE("The kept maps are bounded, and those that are forgotten are named", "[new_map]") {
  MapArchive archive;
  std::vector<std::uint32_t> forgotten;
  for (std::uint32_t id = 1; id <= 40; ++id) {
    KeptMap map;
    map.id = id;
    map.landmarks.resize(id == 30 ? MapArchive::kMostParts : 100);
    map.whole = "graph";
    for (const std::uint32_t one : archive.add(std::move(map))) forgotten.push_back(one);
    CHECK(archive.maps().size() <= MapArchive::kMost);
    CHECK(archive.maps().back().id == id);
    std::size_t whole = 0;
    for (const KeptMap& one : archive.maps()) whole += one.whole.empty() ? 0 : 1;
    CHECK(whole <= MapArchive::kMostWhole);
  }
  REQUIRE(forgotten.size() + archive.maps().size() == 40);
  for (std::uint32_t i = 0; i < forgotten.size(); ++i) CHECK(forgotten[i] == i + 1);
}
