// What SLAM_UPDATE says of each detection, and of what was not seen.
#include <algorithm>
#include <map>
#include <set>

#include "services/geoslam_mapper/pose_publishing.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;

namespace {

sim::Drive round_trip(std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 400.0;
  parameters.path.kind = sim::PathKind::kCircle;
  parameters.path.length_m = 60.0;
  return {parameters, seed};
}

/// Updates of a mapper as SLAM_UPDATE has them, for scans that the caller may change.
template <class Change>
std::vector<model::MapUpdate> updates_of(const sim::Drive& drive, Change change) {
  keyframer::joint::JointKeyframer keyframer({});
  smoothing::SmoothingMapper mapper({});
  std::vector<model::MapUpdate> result;
  for (std::size_t k = 0; k < drive.size(); ++k) {
    sim::SimulatedScan simulated = drive.scan(k);
    change(k, simulated);
    const auto keyframe = keyframer.add(simulated.scan);
    if (!keyframe) continue;
    result.push_back(mapper.add(*keyframe));
    identify_detections(*keyframe, result.back());
  }
  return result;
}

}  // namespace

TEST_CASE("Each detection's landmark is the map's landmark of its trunk", "[seen]") {
  std::size_t told = 0;
  std::size_t named = 0;
  std::size_t wrong = 0;
  for (std::uint64_t seed = 500; seed < 506; ++seed) {
    const sim::Drive drive = round_trip(seed);
    std::map<model::LandmarkId, std::map<std::uint32_t, int>> trunks_of;
    for (const model::MapUpdate& update : updates_of(drive, [](std::size_t, auto&) {})) {
      REQUIRE(update.scans.size() == 8);
      for (const model::IdentifiedDetection& one : update.detections) {
        const std::size_t k = update.scans.at(one.scan).sequence;
        const sim::SimulatedScan simulated = drive.scan(k);
        REQUIRE(update.scans[one.scan].utime == simulated.scan.utime);
        ++told;
        if (one.landmark_id == 0) continue;
        ++named;
        ++trunks_of[one.landmark_id][simulated.trunks.at(one.detection)];
      }
    }
    for (const auto& [id, trunks] : trunks_of) {
      int all = 0;
      int most = 0;
      for (const auto& [trunk, count] : trunks) {
        all += count;
        most = std::max(most, count);
      }
      wrong += static_cast<std::size_t>(all - most);
    }
  }
  CAPTURE(told, named, wrong);
  CHECK(told > 20'000);
  CHECK(named > 9 * told / 10);
  CHECK(1000 * wrong < named);
}

TEST_CASE("A trunk that is gone is expected and not seen; hardly any other is", "[seen]") {
  for (std::uint64_t seed = 510; seed < 516; ++seed) {
    const sim::Drive drive = round_trip(seed);
    // Trunks near the middle of the circle are in view all the way.
    const geometry::SE2 start = drive.world_T_vehicle().front();
    std::set<std::uint32_t> felled;
    for (std::uint32_t i = 0; i < drive.forest().trunks_m.size(); ++i)
      if ((drive.forest().trunks_m[i] - start.translation()).norm() < 12.0) felled.insert(i);
    REQUIRE(felled.size() >= 3);
    const std::size_t half = drive.size() / 2;

    const auto updates = updates_of(drive, [&](std::size_t k, sim::SimulatedScan& simulated) {
      if (k < half) return;
      sim::SimulatedScan rest = simulated;
      rest.scan.detections.clear();
      for (std::size_t i = 0; i < simulated.trunks.size(); ++i)
        if (!felled.contains(simulated.trunks[i]))
          rest.scan.detections.push_back(simulated.scan.detections[i]);
      simulated.scan = rest.scan;
    });

    // Landmarks of the felled trunks.
    std::set<model::LandmarkId> gone;
    for (const model::MapUpdate& update : updates) {
      for (const model::IdentifiedDetection& one : update.detections) {
        const std::size_t k = update.scans.at(one.scan).sequence;
        if (k < half && felled.contains(drive.scan(k).trunks.at(one.detection)))
          gone.insert(one.landmark_id);
      }
    }
    gone.erase(0);

    std::size_t others = 0;
    std::size_t chances = 0;
    for (const model::MapUpdate& update : updates) {
      CHECK(std::ranges::is_sorted(update.expected, {}, &model::ExpectedLandmark::id));
      const bool is_after = update.scans.front().sequence >= half;
      std::size_t expected_gone = 0;
      for (const model::ExpectedLandmark& one : update.expected)
        (gone.contains(one.id) ? expected_gone : others) += 1;
      chances += update.associations.size();
      if (is_after) CHECK(expected_gone + 2 >= felled.size());
      if (update.scans.back().sequence < half) CHECK(expected_gone == 0);
    }
    CAPTURE(others, chances);
    CHECK(20 * others < chances);
  }
}
