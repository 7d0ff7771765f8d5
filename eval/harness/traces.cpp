// traces_of of eval/results.hpp: what the plots need of run 0 of every cell.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "eval/baselines/hierarchy/hierarchy.hpp"
#include "eval/baselines/hierarchy/matching.hpp"
#include "eval/harness/results.hpp"

namespace understory::eval::harness {
namespace {

using nlohmann::json;

constexpr double kDescriptorStep = 0.05;
constexpr double kLocalRange = 60.0;  // [m] of map around the keyframe that a figure shows

json point(const Eigen::Vector2d& p) { return json::array({p.x(), p.y()}); }

json pose(const geometry::SE2& p) { return json::array({p.x(), p.y(), p.theta()}); }

json points(const std::vector<Eigen::Vector2d>& all) {
  json result = json::array();
  for (const Eigen::Vector2d& p : all) result.push_back(point(p));
  return result;
}

json polygons_of(const baselines::hierarchy::Hierarchy& hierarchy) {
  json result = json::array();
  for (const baselines::hierarchy::Polygon& polygon : hierarchy.polygons())
    result.push_back(polygon.vertices);
  return result;
}

/// The map's landmarks near the keyframe, and the number of each in the whole map.
struct LocalMap {
  std::vector<Eigen::Vector2d> positions_m;
  std::vector<model::LandmarkId> ids;

  LocalMap(const std::vector<model::MapLandmark>& landmarks, const Eigen::Vector2d& centre) {
    for (const model::MapLandmark& landmark : landmarks) {
      if ((landmark.position_m - centre).norm() > kLocalRange) continue;
      positions_m.push_back(landmark.position_m);
      ids.push_back(landmark.id);
    }
  }
  int number_of(model::LandmarkId id) const {
    const auto found = std::find(ids.begin(), ids.end(), id);
    return found == ids.end() ? -1 : static_cast<int>(found - ids.begin());
  }
};

/// Both hierarchies as GeoSLAM builds them, and what their polygons match.
void add_polygon_matches(const std::vector<Eigen::Vector2d>& local_m,
                         const std::vector<Eigen::Vector2d>& map_m, json& snapshot) {
  const baselines::hierarchy::Hierarchy local(local_m, kDescriptorStep);
  const baselines::hierarchy::Hierarchy map(map_m, kDescriptorStep);
  json first = json::array();
  for (const baselines::hierarchy::PointMatch& match :
       baselines::hierarchy::match_hierarchies(local, map, {})) {
    first.push_back({match.local, match.other});
  }
  snapshot["keyframe_polygons"] = polygons_of(local);
  snapshot["map_polygons"] = polygons_of(map);
  snapshot["first_associations"] = first;
}

/// Figure 4.9: two hierarchies, associations by polygons alone and after localisation; a method
/// that matches no polygons has its associations only. Figure 4.10: the graph before the
/// optimisation with old, current and new landmarks.
json snapshot_json(const Snapshot& snapshot, bool matches_polygons) {
  const geometry::SE2 base_T_centre = snapshot.keyframe.centre_T_base().inverse();
  std::vector<Eigen::Vector2d> local;
  for (const model::KeyframeLandmark& landmark : snapshot.keyframe.landmarks) {
    local.push_back(base_T_centre * landmark.position_m);
  }

  const LocalMap map(snapshot.landmarks_before, snapshot.update.map_T_vehicle.translation());

  // Associations of the update, as numbers in the local map.
  json filtered = json::array();
  json current = json::array();
  for (const model::Association& association : snapshot.update.associations) {
    const int number = map.number_of(association.landmark_id);
    if (number < 0) continue;
    filtered.push_back({association.keyframe_landmark, number});
    current.push_back(number);
  }

  json added = json::array();
  json old = json::array();
  for (const model::MapLandmark& landmark : snapshot.landmarks_before) {
    old.push_back(point(landmark.position_m));
  }
  for (const model::MapLandmark& landmark : snapshot.landmarks_after) {
    const auto& ids = snapshot.update.added;
    if (std::find(ids.begin(), ids.end(), landmark.id) != ids.end()) {
      added.push_back(point(landmark.position_m));
    }
  }

  json poses = json::array();
  for (const metrics::PoseEstimate& estimate : snapshot.poses_before) {
    poses.push_back(pose(estimate.map_T_vehicle));
  }

  json result = {{"keyframe", points(local)},
                 {"map", points(map.positions_m)},
                 {"filtered_associations", filtered},
                 {"current", current},
                 {"old_landmarks", old},
                 {"new_landmarks", added},
                 {"poses", poses},
                 {"pose", pose(snapshot.update.map_T_vehicle)},
                 {"chi2", snapshot.update.chi2},
                 {"degrees_of_freedom", snapshot.update.degrees_of_freedom}};
  if (matches_polygons) add_polygon_matches(local, map.positions_m, result);
  return result;
}

json trace_json(const RunTrace& trace, const std::string& method, double interval_m) {
  json result{{"travelled_m", json::array()}, {"rpe_cm", json::array()},
              {"lpe_cm", json::array()},      {"newest_pose_cm", json::array()},
              {"poses", json::array()},       {"landmarks", points(trace.final_map.landmarks_m)}};

  for (const StateError& state : trace.states) {
    result["travelled_m"].push_back(interval_m * static_cast<double>(state.scans));
    result["rpe_cm"].push_back(100.0 * state.rpe_m);
    result["lpe_cm"].push_back(100.0 * state.lpe_m);
    result["newest_pose_cm"].push_back(100.0 * state.newest_pose_m);
  }

  for (const metrics::PoseEstimate& estimate : trace.final_map.poses) {
    result["poses"].push_back(pose(estimate.map_T_vehicle));
  }

  if (!trace.true_path.empty()) {
    result["true_path"] = json::array();
    for (const geometry::SE2& place : trace.true_path) result["true_path"].push_back(pose(place));
    result["true_trunks"] = points(trace.true_trunks_m);
  }
  if (trace.snapshot) result["snapshot"] = snapshot_json(*trace.snapshot, method == "baseline");
  return result;
}

}  // namespace

json traces_of(const std::vector<CellResult>& cells, const CampaignOptions& options) {
  json result = json::array();
  for (const CellResult& cell : cells) {
    const sim::Drive drive(cell.cell.drive(), run_seed(options.seed, 0));

    json methods = json::object();
    std::size_t base = 0;
    for (const auto& [method, runs] : cell.runs) {
      methods[method] = trace_json(runs.front().trace, method, cell.cell.interval_m);
      if (!runs.front().trace.true_path.empty()) continue;
      const auto& poses = runs.front().trace.final_map.poses;
      if (!poses.empty()) base = poses.front().scan;
    }

    const metrics::MapTruth truth(drive, base);
    json true_path = json::array();
    for (std::size_t scan = 0; scan < drive.size(); scan += 4) {
      true_path.push_back(pose(truth.map_T_vehicle(scan)));
    }

    json trunks = json::array();
    for (const std::uint32_t trunk : truth.trunks_in_range()) {
      trunks.push_back(point(truth.trunk_m(trunk)));
    }

    result.push_back({{"cell", cell.cell.name()},
                      {"true_path", true_path},
                      {"true_trunks", trunks},
                      {"methods", methods}});
  }
  return result;
}

}  // namespace understory::eval::harness
