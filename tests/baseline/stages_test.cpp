#include <algorithm>
#include <map>
#include <vector>

#include "eval/baselines/keyframer/keyframer.hpp"
#include "eval/baselines/mapper/mapper.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

using eval::baselines::keyframer::Keyframer;
using eval::baselines::mapper::Mapper;
const eval::baselines::keyframer::Parameters kKeyframer;
const eval::baselines::mapper::Parameters kMapper;

sim::DriveParameters small_drive(double sigma_m, double detection_probability) {
  sim::DriveParameters parameters;
  parameters.forest.side_m = 250.0;
  parameters.path.length_m = 32.0;
  parameters.sensor.position_sigma_m = sigma_m;
  parameters.sensor.detection_probability = detection_probability;
  return parameters;
}

std::vector<model::Keyframe> keyframes_of(const sim::Drive& drive, Keyframer& keyframer) {
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
  Keyframer keyframer(kKeyframer);
  const auto keyframes = keyframes_of(drive, keyframer);
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

  CHECK(keyframer.scans() == drive.size());
  CHECK(keyframer.keyframes() == keyframes.size());
}

TEST_CASE("Scans with too little in them make no keyframe and do no harm") {
  Keyframer keyframer(kKeyframer);
  model::LandmarkScan scan;
  for (int i = 0; i < 20; ++i) {
    scan.utime = i;
    scan.sequence = static_cast<std::uint64_t>(i);
    scan.detections.resize(static_cast<std::size_t>(i % 5));  // All at the origin.
    CHECK_FALSE(keyframer.add(scan));
  }
  CHECK(keyframer.scans_unmatched() > 0);
}

TEST_CASE("A copy of a keyframer continues identically") {
  const sim::Drive drive(small_drive(0.2, 0.8), 2);
  Keyframer first(kKeyframer);

  for (std::size_t k = 0; k < drive.size(); ++k) {
    const model::LandmarkScan scan = drive.scan(k).scan;
    Keyframer second = first;
    const auto a = first.add(scan);
    const auto b = second.add(scan);
    REQUIRE(a.has_value() == b.has_value());
    if (a) {
      REQUIRE(a->landmarks.size() == b->landmarks.size());
      for (std::size_t i = 0; i < a->landmarks.size(); ++i) {
        CHECK(a->landmarks[i].position_m == b->landmarks[i].position_m);
      }
    }
    CHECK(second.scans_unmatched() == first.scans_unmatched());
  }
}

TEST_CASE("A map of a noise-free drive agrees with the truth") {
  const sim::Drive drive(small_drive(0.0, 1.0), 3);
  Keyframer keyframer(kKeyframer);
  Mapper mapper(kMapper);
  const auto keyframes = keyframes_of(drive, keyframer);

  for (const model::Keyframe& keyframe : keyframes) {
    const model::MapUpdate update = mapper.add(keyframe);
    CHECK(update.status == (keyframe.sequence == 0 ? model::MapUpdateStatus::kFirstMap
                                                   : model::MapUpdateStatus::kUpdated));
  }

  auto truth = truth_of(drive);
  const geometry::SE2 world_T_map = truth.at(keyframes.front().utime);
  REQUIRE(mapper.trajectory().size() == keyframes.size());

  for (const model::KeyframePose& pose : mapper.trajectory()) {
    const geometry::SE2 expected = world_T_map.inverse() * truth.at(pose.utime);
    CHECK((expected.inverse() * pose.map_T_vehicle).Log().norm() < 0.09);
  }

  for (const model::MapLandmark& landmark : mapper.landmarks()) {
    CHECK(drive.grid().nearest(world_T_map * landmark.position_m)->distance_m < 0.05);
  }
}

TEST_CASE("A map of a noisy drive stays within half a metre") {
  const sim::Drive drive(small_drive(0.2, 0.9), 4);
  Keyframer keyframer(kKeyframer);
  Mapper mapper(kMapper);
  const auto keyframes = keyframes_of(drive, keyframer);
  std::size_t updates = 0;

  for (const model::Keyframe& keyframe : keyframes) {
    const model::MapUpdate update = mapper.add(keyframe);
    updates += update.status == model::MapUpdateStatus::kUpdated ? 1 : 0;
  }

  CHECK(updates + 3 >= keyframes.size());
  auto truth = truth_of(drive);
  const geometry::SE2 world_T_map = truth.at(keyframes.front().utime);

  for (const model::KeyframePose& pose : mapper.trajectory()) {
    const geometry::SE2 expected = world_T_map.inverse() * truth.at(pose.utime);
    CHECK((expected.translation() - pose.map_T_vehicle.translation()).norm() < 0.5);
  }
}

TEST_CASE("A rejected keyframe leaves nothing behind") {
  const sim::Drive drive(small_drive(0.2, 0.9), 5);
  Keyframer keyframer(kKeyframer);
  const auto keyframes = keyframes_of(drive, keyframer);

  // A limit that half of the keyframes keep.
  std::vector<double> errors;
  Mapper usual(kMapper);
  for (const model::Keyframe& keyframe : keyframes) {
    const model::MapUpdate update = usual.add(keyframe);
    if (update.status == model::MapUpdateStatus::kUpdated) errors.push_back(update.chi2);
  }
  REQUIRE(errors.size() > 10);
  std::ranges::sort(errors);
  eval::baselines::mapper::Parameters strict;
  strict.max_newest_pose_error = errors[errors.size() / 2];

  Mapper mapper(strict);
  int rolled_back = 0;
  int updated = 0;
  for (const model::Keyframe& keyframe : keyframes) {
    const eval::baselines::mapper::MapContents before = mapper.map();
    const model::MapUpdate update = mapper.add(keyframe);
    updated += update.status == model::MapUpdateStatus::kUpdated ? 1 : 0;
    if (update.status != model::MapUpdateStatus::kRolledBack) continue;
    ++rolled_back;
    CHECK(mapper.map() == before);
    CHECK(update.associations.empty());
    CHECK(update.added.empty());
  }
  CHECK(rolled_back > 3);
  CHECK(updated > 3);
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

  Keyframer keyframer(kKeyframer);
  Mapper mapper(kMapper);
  mapper.start_with(given);
  auto truth = truth_of(drive);
  std::size_t updates = 0;

  for (const model::Keyframe& keyframe : keyframes_of(drive, keyframer)) {
    const model::MapUpdate update = mapper.add(keyframe);
    if (update.status == model::MapUpdateStatus::kUpdated) {
      ++updates;
      CHECK((truth.at(keyframe.utime).translation() - update.map_T_vehicle.translation()).norm() <
            0.25);
    }
  }

  CHECK(updates >= 10);
  std::size_t observed = 0;

  for (const model::MapLandmark& landmark : mapper.landmarks()) {
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

}  // namespace
}  // namespace understory::test
