// From raw LIDAR through the whole chain: a forest mapped once, then driven again after some of its
// trees were felled and others had grown, with the map of the first drive.
#include <toml++/toml.h>

#include "common/bus/config_layers.hpp"
#include "common/bus/launch_config.hpp"
#include "common/map_file/map_file.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/changes/changing_forest.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::eval::harness;
using namespace understory::sim::changes;

namespace {

constexpr const char* kConfig = UNDERSTORY_SOURCE_CONFIG "/lidar";

ChainRun drive_once(const ForestDrive& drive, std::uint64_t seed,
                    const std::map<std::string, std::string>& toml_instead) {
  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 1200;
  sim::SensorDrive sensors = drive.sensors(suite, {}, seed);
  ChainOptions options;
  options.config_dir = kConfig;
  options.toml_instead = toml_instead;
  return drive_chain(sensors, options);
}

void store(const ChainRun& run, const std::filesystem::path& file) {
  map_file::StoredMap map;
  map.map_id = model::map_of(run.landmarks.back().id);
  map.name = "first drive";
  map.created_utime = run.updates.back().utime;
  map.keyframes = run.keyframes;
  for (const model::MapLandmark& landmark : run.landmarks)
    map.landmarks.push_back({landmark, std::nullopt, std::nullopt});
  map_file::create_map_file(file, {&map, 1}, {map.created_utime, "test", "a drive", "its map"});
}

std::map<std::string, std::string> with_map(const std::filesystem::path& file) {
  toml::table values;
  values.insert("input", toml::table{{"map_file", file.string()}});
  const char* const mapper = "geoslam_mapper";
  return {{mapper, bus::layer_over(bus::config_file_in(kConfig, mapper), values)}};
}

/// World from map, by the truth at the last pose.
geometry::SE2 world_T_map(const ChainRun& run) {
  const model::SlamPose& last = run.slam.back();
  return *pose_at(run.truth, last.utime) * last.map_T_vehicle().inverse();
}

bool is_mapped(const ChainRun& run, const TreeTruth& tree) {
  const Eigen::Vector2d at = world_T_map(run).inverse() * tree.position_m;
  return std::any_of(
      run.landmarks.begin(), run.landmarks.end(),
      [&](const model::MapLandmark& landmark) { return (landmark.position_m - at).norm() < 0.5; });
}

}  // namespace

TEST_CASE("a stored map serves in the changed forest, and keeps what was felled") {
  ChangingForestParameters parameters;
  parameters.course.length_m = 60.0;
  parameters.course.margin_m = 40.0;
  parameters.drives = 2;
  parameters.share = 0.2;
  const ChangingForest forest = make_changing_forest(parameters, 3);
  const test::Scratch scratch("changing-forest");
  const auto file = scratch.path() / "first.gpkg";

  const ChainRun first = drive_once(forest.drives[0], 1, {});
  REQUIRE_FALSE(first.landmarks.empty());
  store(first, file);
  const ChainRun second = drive_once(forest.drives[1], 2, with_map(file));
  REQUIRE(second.slam.size() > 100);
  CHECK(wrong_updates(second) == 0);
  CHECK(trajectory_error(poses_of(second.slam), second.truth).ate_rms_m < 0.05);

  int felled = 0, felled_kept = 0, grown_mapped = 0, stay = 0, stay_mapped = 0;
  for (const TreeTruth& tree : forest.trees) {
    const bool was_mapped = tree.stands_in(0) && is_mapped(first, tree);
    if (was_mapped && !tree.stands_in(1)) {
      ++felled;
      felled_kept += is_mapped(second, tree) ? 1 : 0;
    }
    if (was_mapped && tree.stands_in(1)) {
      ++stay;
      stay_mapped += is_mapped(second, tree) ? 1 : 0;
    }
    grown_mapped += !tree.stands_in(0) && is_mapped(second, tree) ? 1 : 0;
  }
  CAPTURE(felled, felled_kept, grown_mapped, stay, stay_mapped);
  CHECK(felled > 5);
  CHECK(grown_mapped > 5);
  CHECK(stay > 20);
  CHECK(stay_mapped == stay);
}
