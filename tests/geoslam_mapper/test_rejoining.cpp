// A map that was left is found again and becomes part of the map in use.
#include <cmath>
#include <map>

#include "common/geometry/alignment.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kInterval_m = 0.2;
constexpr std::size_t kScansPerKeyframe = 8;
/// The vehicle is switched off here [m], and on again there.
constexpr double kOff_m = 120.0;
constexpr double kOn_m = 200.0;
constexpr model::Utime kCarried_us = 600'000'000;

/// Two rounds of 300 m.
sim::Drive rounds(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 500.0;
  parameters.path.kind = sim::PathKind::kDoubleCircle;
  parameters.path.length_m = 600.0;
  parameters.path.interval = kInterval_m;
  parameters.sensor.range_m = 20.0;
  parameters.sensor.position_sigma_m = 0.05;
  parameters.clear_the_path = true;
  return {parameters, seed};
}

/// Scan numbers of the way before and after the vehicle was carried.
std::size_t scan_at(double path_m) { return static_cast<std::size_t>(path_m / kInterval_m); }

struct Part {
  std::vector<model::Keyframe> keyframes;
  std::vector<geometry::SE2> world_T_base;
};

/// Keyframes of scans [from, to), with sequences and stamps that go on after `before`.
Part part(const sim::Drive& drive, std::size_t from, std::size_t to, model::Utime late_us,
          std::uint64_t sequence) {
  keyframer::joint::JointKeyframer keyframer({});
  Part result;
  for (std::size_t k = from; k < to; ++k) {
    model::LandmarkScan scan = drive.scan(k).scan;
    scan.utime += late_us;
    auto keyframe = keyframer.add(scan);
    if (!keyframe) continue;
    const std::size_t base = from + kScansPerKeyframe * result.keyframes.size();
    result.world_T_base.push_back(drive.world_T_vehicle()[base]);
    keyframe->sequence = sequence + result.keyframes.size();
    result.keyframes.push_back(*std::move(keyframe));
  }
  return result;
}

struct Outcome {
  std::size_t joined_at = 0;  ///< Keyframes of the second part until then; 0: never.
  std::size_t merged = 0;
};

Outcome feed(const Part& first, const Part& second, SmoothingMapper& mapper) {
  for (const model::Keyframe& keyframe : first.keyframes) (void)mapper.add(keyframe);
  Outcome outcome;
  for (std::size_t k = 0; k < second.keyframes.size(); ++k) {
    const bool was_left = !mapper.kept_maps().maps().empty();
    const model::MapUpdate update = mapper.add(second.keyframes[k]);
    if (was_left && mapper.kept_maps().maps().empty()) outcome.joined_at = k + 1;
    if (outcome.joined_at > 0) outcome.merged += update.merged.size();
  }
  return outcome;
}

/// RMS distance of the trajectory to the truth, as one map [m].
double error_m(const Part& first, const Part& second, const SmoothingMapper& mapper) {
  std::map<std::uint64_t, geometry::SE2> truth;
  for (const Part* one : {&first, &second})
    for (std::size_t k = 0; k < one->keyframes.size(); ++k)
      truth.emplace(one->keyframes[k].sequence, one->world_T_base[k]);
  std::vector<Eigen::Vector2d> estimated;
  std::vector<Eigen::Vector2d> true_m;
  for (const model::KeyframePose& pose : mapper.trajectory()) {
    estimated.push_back(pose.map_T_vehicle.translation());
    true_m.push_back(truth.at(pose.keyframe_sequence).translation());
  }
  const geometry::SE2 world_T_map = geometry::align_rigid(true_m, estimated);
  double squared = 0.0;
  for (std::size_t i = 0; i < estimated.size(); ++i)
    squared += (world_T_map * estimated[i] - true_m[i]).squaredNorm();
  return std::sqrt(squared / static_cast<double>(estimated.size()));
}

/// Landmarks of the map that are nearer to another one than any two trunks are to each other.
std::size_t doubles(const SmoothingMapper& mapper, double nearer_m) {
  const std::vector<model::MapLandmark> landmarks = mapper.landmarks();
  std::size_t count = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((landmarks[i].position_m - landmarks[k].position_m).norm() < nearer_m) ++count;
  return count;
}

/// Least distance of two trunks of the forest, of those that are within 0.6 m of each other.
double least_distance_m(const sim::Drive& drive) {
  const auto& trunks = drive.forest().trunks_m;
  double least_m = 0.6;
  for (std::size_t i = 0; i < trunks.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) least_m = std::min(least_m, (trunks[i] - trunks[k]).norm());
  return least_m;
}

}  // namespace

TEST_CASE("Carried away while switched off, and back: two maps become one", "[rejoining]") {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const sim::Drive drive = rounds(seed);
    const Part first = part(drive, 0, scan_at(kOff_m), 0, 0);
    const Part second =
        part(drive, scan_at(kOn_m), drive.size(), kCarried_us, first.keyframes.size());
    SmoothingMapper mapper({});
    const Outcome outcome = feed(first, second, mapper);

    INFO("seed " << seed);
    // Soon after the first landmarks of the other map are in view, 80 m from where it was switched
    // on.
    CHECK(outcome.joined_at > 0);
    CHECK(outcome.joined_at < 80);
    CHECK(outcome.merged >= 6);
    CHECK(mapper.kept_maps().maps().empty());
    CHECK(mapper.trajectory().size() == first.keyframes.size() + second.keyframes.size());
    CHECK(error_m(first, second, mapper) < 0.15);
    CHECK(doubles(mapper, 0.5 * least_distance_m(drive)) * 100 <= mapper.landmarks().size());

    // Their ids stay.
    const auto landmarks = mapper.landmarks();
    CHECK(
        std::ranges::any_of(landmarks, [](const auto& one) { return model::map_of(one.id) == 1; }));
    CHECK(
        std::ranges::any_of(landmarks, [](const auto& one) { return model::map_of(one.id) == 2; }));
  }
}

TEST_CASE("A given map is found from a map that was begun beside it", "[rejoining]") {
  const sim::Drive drive = rounds(7);
  const Part first = part(drive, 0, scan_at(kOff_m), 0, 0);
  const Part second =
      part(drive, scan_at(kOn_m), drive.size(), kCarried_us, first.keyframes.size());
  SmoothingMapper surveyor({});
  for (const model::Keyframe& keyframe : first.keyframes) (void)surveyor.add(keyframe);
  const std::vector<model::MapLandmark> given = surveyor.landmarks();

  // It begins beside the given map: another one is begun, and the given one found from within it.
  SmoothingMapper mapper({});
  mapper.start_with(given);
  const Outcome outcome = feed({}, second, mapper);
  CHECK(outcome.joined_at > 0);
  CHECK(outcome.merged >= 6);
  const auto landmarks = mapper.landmarks();
  for (const model::MapLandmark& one : given) {
    // Each is there under its id, or became another one.
    const auto found = std::ranges::find(landmarks, one.id, &model::MapLandmark::id);
    if (found != landmarks.end()) CHECK(found->covariance_m2.determinant() > 0.0);
  }
  CHECK(doubles(mapper, 0.5 * least_distance_m(drive)) * 100 <= landmarks.size());
}

TEST_CASE("Another forest is never taken for a map that was left", "[rejoining]") {
  std::size_t keyframes = 0;
  for (std::uint64_t seed = 20; seed < 26; ++seed) {
    const sim::Drive here = rounds(seed);
    const sim::Drive there = rounds(seed + 100);
    const Part first = part(here, 0, scan_at(kOff_m), 0, 0);
    const Part second = part(there, 0, there.size(), kCarried_us, first.keyframes.size());
    SmoothingMapper mapper({});
    const Outcome outcome = feed(first, second, mapper);
    CHECK(outcome.joined_at == 0);
    CHECK(mapper.kept_maps().maps().size() == 1);
    keyframes += second.keyframes.size();
  }
  CHECK(keyframes > 2000);
}

TEST_CASE("A mapper that is restarted on the way back joins the maps as well", "[rejoining]") {
  const sim::Drive drive = rounds(8);
  const Part first = part(drive, 0, scan_at(kOff_m), 0, 0);
  const Part second =
      part(drive, scan_at(kOn_m), drive.size(), kCarried_us, first.keyframes.size());
  auto mapper = std::make_unique<SmoothingMapper>(SmoothingMapperParameters{});
  for (const model::Keyframe& keyframe : first.keyframes) (void)mapper->add(keyframe);
  for (std::size_t k = 0; k < second.keyframes.size(); ++k) {
    (void)mapper->add(second.keyframes[k]);
    if (k % 10 != 9) continue;
    auto restarted = std::make_unique<SmoothingMapper>(SmoothingMapperParameters{});
    restarted->load(mapper->save());
    mapper = std::move(restarted);
  }
  CHECK(mapper->kept_maps().maps().empty());
  CHECK(error_m(first, second, *mapper) < 0.15);
}
