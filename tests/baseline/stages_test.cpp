#include <map>

#include "services/geoslam_mapper/baseline/mapper.hpp"
#include "services/keyframer/baseline/keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

sim::DriveParameters small_drive(double sigma_m, double detection_probability) {
  sim::DriveParameters parameters;
  parameters.forest.side_m = 250.0;
  parameters.path.length_m = 32.0;
  parameters.sensor.position_sigma_m = sigma_m;
  parameters.sensor.detection_probability = detection_probability;
  return parameters;
}

std::vector<model::Keyframe> keyframes_of(const sim::Drive& drive,
                                          keyframer::KeyframerMethod& keyframer) {
  std::vector<model::Keyframe> keyframes;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    if (auto keyframe = keyframer.add(drive.scan(k).scan)) {
      keyframes.push_back(std::move(*keyframe));
    }
  }
  return keyframes;
}

std::map<model::Utime, geometry::SE2> truth_of(const sim::Drive& drive) {
  std::map<model::Utime, geometry::SE2> truth;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    truth[drive.utime(k)] = drive.world_T_vehicle()[k];
  }
  return truth;
}

TEST_CASE("A keyframe comes with every eighth scan, in the frame of its base") {
  const sim::Drive drive(small_drive(0.05, 0.95), 1);
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto keyframes = keyframes_of(drive, *keyframer);
  CHECK(keyframes.size() == drive.size() / 8);
  auto truth = truth_of(drive);

  for (const model::Keyframe& keyframe : keyframes) {
    REQUIRE(keyframe.members.size() == 8);
    CHECK(keyframe.utime == keyframe.members.front().utime);
    CHECK(keyframe.centre_T_base().Log().norm() == 0.0);
    const geometry::SE2 world_T_base = truth.at(keyframe.utime);
    for (const model::KeyframeMember& member : keyframe.members) {
      const geometry::SE2 base_T_member = world_T_base.inverse() * truth.at(member.utime);
      CHECK((base_T_member.inverse() * member.centre_T_vehicle).Log().norm() < 0.5);
    }
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      const auto trunk = drive.grid().nearest(world_T_base * landmark.position_m);
      REQUIRE(trunk);
      CHECK(trunk->distance_m < 0.8);
      CHECK(landmark.observation_count >= 2);
      CHECK(landmark.observation_count <= 8);
    }
  }

  CHECK(keyframer->counters().scans == drive.size());
  CHECK(keyframer->counters().keyframes == keyframes.size());
}

TEST_CASE("Scans with too little in them make no keyframe and do no harm") {
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  model::LandmarkScan scan;
  for (int i = 0; i < 20; ++i) {
    scan.utime = i;
    scan.sequence = static_cast<std::uint64_t>(i);
    scan.detections.resize(static_cast<std::size_t>(i % 5));  // All at the origin.
    CHECK_FALSE(keyframer->add(scan));
  }
  CHECK(keyframer->counters().scans_unmatched > 0);
}

TEST_CASE("A keyframer that was saved and loaded continues identically") {
  const sim::Drive drive(small_drive(0.2, 0.8), 2);
  const auto first = keyframer::baseline::make_baseline_keyframer({});
  auto second = keyframer::baseline::make_baseline_keyframer({});

  for (std::size_t k = 0; k < drive.size(); ++k) {
    const model::LandmarkScan scan = drive.scan(k).scan;
    const auto a = first->add(scan);
    const auto b = second->add(scan);
    REQUIRE(a.has_value() == b.has_value());
    if (a) {
      REQUIRE(a->landmarks.size() == b->landmarks.size());
      for (std::size_t i = 0; i < a->landmarks.size(); ++i) {
        CHECK(a->landmarks[i].position_m == b->landmarks[i].position_m);
      }
    }
    const std::string state = second->save();
    second = keyframer::baseline::make_baseline_keyframer({});
    second->load(state);
    CHECK(second->save() == first->save());
  }
}

TEST_CASE("A map of a noise-free drive agrees with the truth") {
  const sim::Drive drive(small_drive(0.0, 1.0), 3);
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto mapper = geoslam_mapper::baseline::make_baseline_mapper({});
  const auto keyframes = keyframes_of(drive, *keyframer);

  for (const model::Keyframe& keyframe : keyframes) {
    const model::MapUpdate update = mapper->add(keyframe);
    CHECK(update.status == (keyframe.sequence == 0 ? model::MapUpdateStatus::kFirstMap
                                                   : model::MapUpdateStatus::kUpdated));
  }

  auto truth = truth_of(drive);
  const geometry::SE2 world_T_map = truth.at(keyframes.front().utime);
  REQUIRE(mapper->trajectory().size() == keyframes.size());

  for (const model::KeyframePose& pose : mapper->trajectory()) {
    const geometry::SE2 expected = world_T_map.inverse() * truth.at(pose.utime);
    CHECK((expected.inverse() * pose.map_T_vehicle).Log().norm() < 0.09);
  }

  for (const model::MapLandmark& landmark : mapper->landmarks()) {
    CHECK(drive.grid().nearest(world_T_map * landmark.position_m)->distance_m < 0.05);
  }
}

TEST_CASE("A map of a noisy drive stays within half a metre") {
  const sim::Drive drive(small_drive(0.2, 0.9), 4);
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto mapper = geoslam_mapper::baseline::make_baseline_mapper({});
  const auto keyframes = keyframes_of(drive, *keyframer);
  std::size_t updates = 0;

  for (const model::Keyframe& keyframe : keyframes) {
    const model::MapUpdate update = mapper->add(keyframe);
    updates += update.status == model::MapUpdateStatus::kUpdated ? 1 : 0;
  }

  CHECK(updates + 3 >= keyframes.size());
  auto truth = truth_of(drive);
  const geometry::SE2 world_T_map = truth.at(keyframes.front().utime);

  for (const model::KeyframePose& pose : mapper->trajectory()) {
    const geometry::SE2 expected = world_T_map.inverse() * truth.at(pose.utime);
    CHECK((expected.translation() - pose.map_T_vehicle.translation()).norm() < 0.5);
  }
}

TEST_CASE("A rejected keyframe leaves nothing behind") {
  const sim::Drive drive(small_drive(0.2, 0.9), 5);
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto keyframes = keyframes_of(drive, *keyframer);
  geoslam_mapper::BaselineMapperParameters strict;
  strict.max_newest_pose_error = 1e-6;
  const auto good = geoslam_mapper::baseline::make_baseline_mapper({});
  const auto bad = geoslam_mapper::baseline::make_baseline_mapper(strict);
  int rolled_back = 0;

  for (const model::Keyframe& keyframe : keyframes) {
    const std::string before = good->save();
    bad->load(before);
    const model::MapUpdate refused = bad->add(keyframe);
    const model::MapUpdate accepted = good->add(keyframe);
    if (accepted.status == model::MapUpdateStatus::kUpdated) {
      ++rolled_back;
      CHECK(refused.status == model::MapUpdateStatus::kRolledBack);
      CHECK(bad->save() == before);
      CHECK(refused.associations.empty());
    }
  }
  CHECK(rolled_back > 10);
}

TEST_CASE("A mapper that was saved and loaded continues identically") {
  const sim::Drive drive(small_drive(0.2, 0.9), 6);
  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto first = geoslam_mapper::baseline::make_baseline_mapper({});
  auto second = geoslam_mapper::baseline::make_baseline_mapper({});
  for (const model::Keyframe& keyframe : keyframes_of(drive, *keyframer)) {
    first->add(keyframe);
    second->add(keyframe);
    const std::string state = second->save();
    CHECK(state == first->save());
    second = geoslam_mapper::baseline::make_baseline_mapper({});
    second->load(state);
  }
}

TEST_CASE("In a given map a landmark counts once it was observed") {
  const sim::Drive drive(small_drive(0.05, 0.95), 7);
  std::vector<model::MapLandmark> given;
  for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
    model::MapLandmark landmark;
    landmark.id = 1000 + given.size();
    landmark.position_m = trunk;
    given.push_back(landmark);
  }

  const auto keyframer = keyframer::baseline::make_baseline_keyframer({});
  const auto mapper = geoslam_mapper::baseline::make_baseline_mapper({});
  mapper->start_with(given);
  auto truth = truth_of(drive);
  std::size_t updates = 0;

  for (const model::Keyframe& keyframe : keyframes_of(drive, *keyframer)) {
    const model::MapUpdate update = mapper->add(keyframe);
    if (update.status == model::MapUpdateStatus::kUpdated) {
      ++updates;
      CHECK((truth.at(keyframe.utime).translation() - update.map_T_vehicle.translation()).norm() <
            0.25);
    }
  }

  CHECK(updates >= 10);
  std::size_t observed = 0;

  for (const model::MapLandmark& landmark : mapper->landmarks()) {
    const std::size_t number = landmark.id - 1000;
    if (number >= given.size()) {
      continue;  // Discovered, not given.
    }
    observed += landmark.observation_count > 0 ? 1 : 0;
    if (landmark.observation_count == 0) {
      CHECK(landmark.position_m == given[number].position_m);
    }
  }

  CHECK(observed > 30);
  CHECK(observed < given.size());
}

TEST_CASE("Foreign bytes are no state") {
  CHECK_THROWS_AS(geoslam_mapper::baseline::make_baseline_mapper({})->load("no state"),
                  std::invalid_argument);
  CHECK_THROWS_AS(keyframer::baseline::make_baseline_keyframer({})->load("no state"),
                  std::invalid_argument);
}

}  // namespace
}  // namespace understory::test
