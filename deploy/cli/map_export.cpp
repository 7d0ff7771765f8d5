// `understory map export`: maps in formats of other tools.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/reference_system/reference_system.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/geojson_geometry.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/slam_results.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct MapExportOptions {
  std::string file;
  fs::path out;
  std::vector<std::string> formats;  ///< Empty = all formats possible for the file.
};

/// Converts positions of a map to the earth.
class Earth {
 public:
  explicit Earth(const model::MapReference& reference)
      : wgs84_(reference_system::to_wgs84(reference)) {}

  Eigen::Vector2d place_deg(const Eigen::Vector2d& position_m) const {
    return wgs84_.forward(position_m);
  }
  Json point(const Eigen::Vector2d& position_m) const {
    return point_geometry(place_deg(position_m));
  }

 private:
  reference_system::Transformation wgs84_;
};

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

template <int N>
Json matrix_json(const Eigen::Matrix<double, N, N>& matrix) {
  if (matrix.isZero(0.0)) return nullptr;
  Json rows = Json::array();
  for (int i = 0; i < N; ++i) {
    Json row = Json::array();
    for (int j = 0; j < N; ++j) row.push_back(matrix(i, j));
    rows.push_back(row);
  }
  return rows;
}

Json feature(Json geometry, Json properties) {
  return {{"type", "Feature"},
          {"geometry", std::move(geometry)},
          {"properties", std::move(properties)}};
}

/// Existence by landmark, from the states.
ExistenceById existence_of(const map_file::StoredMap& map) {
  ExistenceById existence;
  if (!map.existence) return existence;
  for (const map_file::ExistenceRow& row : map.existence->landmarks)
    existence[row.existence.id] = row.existence;
  return existence;
}

Json landmark_features(const map_file::StoredMap& map, const Earth& earth) {
  const ExistenceById existence = existence_of(map);
  Json features = Json::array();
  for (const map_file::StoredLandmark& one : map.landmarks) {
    const model::MapLandmark& landmark = one.landmark;
    const bool is_trunk = landmark.kind == model::LandmarkKind::kTrunk;
    const auto told = existence.find(landmark.id);
    features.push_back(
        feature(earth.point(landmark.position_m),
                {{"landmark_id", landmark.id},
                 {"submap_id", or_null(one.submap_id)},
                 {"covariance_m2", matrix_json(landmark.covariance_m2)},
                 {"diameter_m", landmark.radius_m > 0.0 ? Json(2.0 * landmark.radius_m) : Json()},
                 {"kind", is_trunk ? "trunk" : "corner"},
                 {"times_seen", landmark.observation_count},
                 {"existence", or_null(one.existence)},
                 {"in_use", told == existence.end() ? Json() : Json(told->second.is_in_use)}}));
  }
  return features;
}

Json keyframe_features(const map_file::StoredMap& map, const Earth& earth) {
  Json features = Json::array();
  for (const model::KeyframePose& pose : map.keyframes) {
    features.push_back(feature(earth.point(pose.map_T_vehicle.translation()),
                               {{"sequence", pose.keyframe_sequence},
                                {"utime", pose.utime},
                                {"heading_rad", pose.map_T_vehicle.theta()},
                                {"covariance", matrix_json(pose.covariance)}}));
  }
  return features;
}

Json border_features(const map_file::StoredMap& map, const Earth& earth) {
  Json features = Json::array();
  for (const map_file::SubmapBorder& border : map.submap_borders) {
    PlacesDeg corners;
    for (const Eigen::Vector2d& corner : border.corners_m)
      corners.push_back(earth.place_deg(corner));
    features.push_back(feature(polygon_geometry(corners), {{"submap_id", border.submap_id}}));
  }
  return features;
}

Json loop_features(const map_file::StoredMap& map, const Earth& earth) {
  Json features = Json::array();
  for (const map_file::LoopClosure& loop : map.loop_closures) {
    features.push_back(
        feature(line_geometry({earth.place_deg(loop.from_m), earth.place_deg(loop.to_m)}),
                {{"from_sequence", loop.from_sequence}, {"to_sequence", loop.to_sequence}}));
  }
  return features;
}

model::WholeMap whole_map_of(const map_file::StoredMap& map) {
  model::WholeMap whole;
  whole.landmarks.reserve(map.landmarks.size());
  for (const map_file::StoredLandmark& one : map.landmarks) whole.landmarks.push_back(one.landmark);
  whole.keyframes = map.keyframes;
  return whole;
}

void write_export(const fs::path& file, const std::string& text) {
  write_text_file(file, text);
  fmt::print("{}\n", file.string());
}

void export_map_as(const std::string& format, const map_file::StoredMap& map,
                   const std::optional<model::MapReference>& reference, const fs::path& out) {
  if (format == "csv") {
    const model::WholeMap whole = whole_map_of(map);
    write_export(out / "landmarks.csv", landmarks_csv(whole, existence_of(map)));
    write_export(out / "keyframes.csv", keyframes_csv(whole));
  } else {
    for (const auto& [layer, text] : map_geojson(map, reference.value()))
      write_export(out / (layer + ".geojson"), text);
  }
}

void run_map_export(MapExportOptions options) {
  const map_file::MapFile file(options.file, map_file::Access::kRead);
  const std::optional<model::MapReference> reference = file.reference();
  const bool is_placed = reference.has_value();
  if (options.formats.empty()) {
    options.formats = {"csv"};
    if (is_placed) options.formats.emplace_back("geojson");
  }
  if (!is_placed && std::ranges::find(options.formats, "geojson") != options.formats.end())
    fail(place_missing(options.file));
  for (const map_file::MapSummary& summary : file.maps()) {
    const map_file::StoredMap map = file.read(summary.map_id);
    const fs::path folder = options.out / fmt::format("map-{}", summary.map_id);
    fs::create_directories(folder);
    for (const std::string& format : options.formats) export_map_as(format, map, reference, folder);
  }
}

}  // namespace

std::string place_missing(const std::string& file) {
  return fmt::format(
      "{}: GeoJSON needs longitude and latitude, and the map is not georeferenced: `understory map "
      "georeference` does it from control points, from the fixes of a drive or from another map",
      file);
}

std::vector<std::pair<std::string, std::string>> map_geojson(const map_file::StoredMap& map,
                                                             const model::MapReference& reference) {
  const Earth earth(reference);
  std::vector<std::pair<std::string, std::string>> layers;
  const auto add = [&](const std::string& name, Json features, bool is_always) {
    if (features.empty() && !is_always) return;
    const Json collection{
        {"type", "FeatureCollection"}, {"name", name}, {"features", std::move(features)}};
    layers.emplace_back(name, dumped(collection, -1) + "\n");
  };
  add("landmarks", landmark_features(map, earth), true);
  add("trajectory", keyframe_features(map, earth), true);
  add("submap_borders", border_features(map, earth), false);
  add("loop_closures", loop_features(map, earth), false);
  return layers;
}

void add_map_export(CLI::App& map) {
  auto* command = map.add_subcommand("export", "Each map in formats that other tools read");
  const auto options = std::make_shared<MapExportOptions>();
  command->add_option("file", options->file, "A map file")->required();
  command->add_option("--out", options->out, "Directory; each map has a folder map-N in it")
      ->required();
  command
      ->add_option("--format", options->formats,
                   "csv: metres of the map; geojson: longitude and latitude (default: both if the "
                   "map is georeferenced, else csv)")
      ->delimiter(',')
      ->check(CLI::IsMember({"csv", "geojson"}));
  command->callback([options] { guarded_map_work([&] { run_map_export(*options); }); });
}

}  // namespace understory::cli
