#include "services/viewer/scene_frame.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "services/viewer/frame_writer.hpp"
#include "services/viewer/hierarchy_overlay.hpp"
#include "services/viewer/scene_json.hpp"

namespace understory::viewer {
namespace {

void add_landmarks(const LandmarkTable& table, const FrameRequest& request, LandmarkCursor& cursor,
                   nlohmann::ordered_json& header, FrameWriter& writer) {
  const auto slots = table.changed_since(cursor, request.most_landmarks);
  if (slots.empty()) return;
  header["landmarks"] = {
      {"slots", table.slots().size()}, {"used", table.size()}, {"unused", table.unused()}};

  // A function for each column: the page reads columns.
  const auto column = [&]<class T>(const std::string& name, T (*value)(const SceneLandmark&)) {
    std::vector<T> values;
    values.reserve(slots.size());
    for (const Slot slot : slots) values.push_back(value(table.slots()[slot]));
    writer.add(name, std::span<const T>(values));
  };
  using L = const SceneLandmark&;
  writer.add("slot", std::span<const std::uint32_t>(slots));
  column(
      "id_low", +[](L one) { return static_cast<std::uint32_t>(one.id & 0xffffffffU); });
  column(
      "id_high", +[](L one) { return static_cast<std::uint32_t>(one.id >> 32U); });
  column(
      "x", +[](L one) { return one.x_m; });
  column(
      "y", +[](L one) { return one.y_m; });
  column(
      "cxx", +[](L one) { return one.covariance_xx_m2; });
  column(
      "cxy", +[](L one) { return one.covariance_xy_m2; });
  column(
      "cyy", +[](L one) { return one.covariance_yy_m2; });
  column(
      "radius", +[](L one) { return one.radius_m; });
  column(
      "probability", +[](L one) { return one.probability; });
  column(
      "seen", +[](L one) { return one.seen; });
  column(
      "flags", +[](L one) { return one.flags; });
}

void add_points(std::span<const TrackPoint> points, const std::string& prefix, bool is_whole,
                FrameWriter& writer) {
  const auto column = [&]<class T>(const std::string& name, T (*value)(const TrackPoint&)) {
    std::vector<T> values;
    values.reserve(points.size());
    for (const TrackPoint& point : points) values.push_back(value(point));
    writer.add(prefix + name, std::span<const T>(values));
  };
  using P = const TrackPoint&;
  column(
      "_x", +[](P one) { return one.x_m; });
  column(
      "_y", +[](P one) { return one.y_m; });
  if (prefix != "truth")
    column(
        "_utime", +[](P one) { return static_cast<double>(one.utime); });
  if (!is_whole) return;
  column(
      "_theta", +[](P one) { return one.theta_rad; });
  column(
      "_sigma", +[](P one) { return one.sigma_m; });
  column(
      "_status", +[](P one) { return one.status; });
}

/// `key` in the header, `prefix` of the arrays.
void add_track(const Track& track, const char* key, const std::string& prefix, Change now,
               std::size_t most, TrackCursor& cursor, nlohmann::ordered_json& header,
               FrameWriter& writer) {
  if (!track.has_changed_since(cursor)) return;
  const std::size_t first = track.first_unread(cursor);
  const auto points = track.points().subspan(first, std::min(most, track.points().size() - first));
  header[key] = {{"first", first}, {"total", first + points.size()}};
  add_points(points, prefix, prefix == "path", writer);
  cursor = {now, first + points.size()};
}

void add_scan(const Scene& scene, const FrameRequest& request, nlohmann::ordered_json& header,
              FrameWriter& writer) {
  const SceneScan& scan = scene.scan().value;
  header["scan"] = {{"utime", scan.utime}};
  std::vector<float> x;
  std::vector<float> y;
  std::vector<float> z;
  std::vector<std::uint8_t> kinds;
  if (request.overlays.contains("scan")) {
    for (const auto& point : scan.points_m) {
      x.push_back(point[0]);
      y.push_back(point[1]);
      z.push_back(point[2]);
    }
  }
  writer.add("scan_x", std::span<const float>(x));
  writer.add("scan_y", std::span<const float>(y));
  writer.add("scan_z", std::span<const float>(z));

  x.clear();
  y.clear();
  z.clear();
  for (const model::Detection& one : scan.detections) {
    x.push_back(static_cast<float>(one.position_m.x()));
    y.push_back(static_cast<float>(one.position_m.y()));
    z.push_back(static_cast<float>(one.radius_m));
    kinds.push_back(static_cast<std::uint8_t>(one.kind));
  }
  writer.add("detection_x", std::span<const float>(x));
  writer.add("detection_y", std::span<const float>(y));
  writer.add("detection_radius", std::span<const float>(z));
  writer.add("detection_kind", std::span<const std::uint8_t>(kinds));
}

/// Slot of an expected landmark at the page; none if it is out of use, since it is not expected
/// then.
std::optional<Slot> slot_in_use(const LandmarkTable& table, model::LandmarkId id) {
  const auto slot = table.slot_of(id);
  if (slot && (table.slots()[*slot].flags & SceneLandmark::kOutOfUse) != 0) return std::nullopt;
  return slot;
}

void add_matches(const Scene& scene, nlohmann::ordered_json& header, FrameWriter& writer) {
  const model::MapUpdate& update = scene.matches().value.update;
  const LandmarkTable& table = scene.landmarks();
  std::vector<std::uint32_t> matched;
  std::vector<std::uint32_t> unseen;
  std::size_t seen = 0;
  for (const model::Association& one : update.associations) {
    if (const auto slot = table.slot_of(one.landmark_id)) matched.push_back(*slot);
    const bool is_new = std::ranges::find(update.added, one.landmark_id) != update.added.end();
    if (!is_new && slot_in_use(table, one.landmark_id)) ++seen;
  }
  for (const model::ExpectedLandmark& one : update.expected) {
    if (one.sight == model::LineOfSight::kBlocked) continue;
    if (const auto slot = slot_in_use(table, one.id)) unseen.push_back(*slot);
  }
  header["matches"] = matches_json(update);
  header["matches"]["expected"] = seen + unseen.size();
  writer.add("match_slot", std::span<const std::uint32_t>(matched));
  writer.add("unseen_slot", std::span<const std::uint32_t>(unseen));
}

void add_hierarchy(const Scene& scene, nlohmann::ordered_json& header, FrameWriter& writer) {
  const HierarchyOverlay overlay = hierarchy_around_vehicle(scene);
  header["hierarchy"] = {{"levels", 2}};
  writer.add("edge_a", std::span<const std::uint32_t>(overlay.from));
  writer.add("edge_b", std::span<const std::uint32_t>(overlay.to));
  writer.add("edge_level", std::span<const std::uint8_t>(overlay.level));
}

}  // namespace

bool has_news(const Scene& scene, const SceneCursor& cursor) {
  return scene.change() > cursor.change || scene.landmarks().has_changed_since(cursor.landmarks) ||
         scene.driven().has_changed_since(cursor.driven) ||
         scene.keyframes().has_changed_since(cursor.keyframes) ||
         scene.truth().has_changed_since(cursor.truth);
}

bool has_moved(const Scene& scene, const SceneCursor& cursor) {
  return std::max({scene.reset_change(), scene.pose().change, scene.verdict().change}) >
         cursor.change;
}

std::shared_ptr<const std::string> make_frame(const Scene& scene, const FrameRequest& request,
                                              const nlohmann::ordered_json& extra,
                                              SceneCursor& cursor) {
  FrameWriter writer;
  nlohmann::ordered_json header = {{"kind", "frame"},
                                   {"run", request.run},
                                   {"seq", request.sequence},
                                   {"wall_ms", 1e-3 * static_cast<double>(request.wall_us)},
                                   {"skipped", request.skipped},
                                   {"utime", scene.utime()}};
  if (cursor.change < scene.reset_change()) {
    header["reset"] = true;
    cursor = {};
  }
  const Change before = cursor.change;
  const Change now = scene.change();

  // Parts that grow with the map, in bounded pieces.
  add_landmarks(scene.landmarks(), request, cursor.landmarks, header, writer);
  add_track(scene.driven(), "path", "path", now, request.most_points, cursor.driven, header,
            writer);
  add_track(scene.keyframes(), "keyframes", "keyframe", now, request.most_points, cursor.keyframes,
            header, writer);
  add_track(scene.truth(), "truth_path", "truth", now, request.most_points, cursor.truth, header,
            writer);

  // Parts that are sent as a whole.
  if (scene.scan().change > before) add_scan(scene, request, header, writer);
  if (scene.matches().change > before) {
    add_matches(scene, header, writer);
    if (request.overlays.contains("hierarchy")) add_hierarchy(scene, header, writer);
  }
  add_parts(scene, before, header);
  cursor.change = now;
  for (const auto& [key, value] : extra.items()) {
    if (key == "numbers" && header.contains(key)) {
      header[key].update(value);
    } else {
      header[key] = value;
    }
  }
  return writer.message(std::move(header));
}

}  // namespace understory::viewer
