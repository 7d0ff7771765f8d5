#include "common/foxglove/messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/foxglove/json_text.hpp"
#include "common/foxglove/scene.hpp"
#include "common/terminal/printable.hpp"
#include "common/wire/convert.hpp"

namespace understory::foxglove {
namespace {

constexpr std::size_t kPointBytes = 13;
constexpr int kFloat32 = 7;  // foxglove.NumericType
constexpr int kUint8 = 1;

void begin_message(JsonText& out, model::Utime utime, std::string_view frame) {
  out.begin_object();
  time_field(out, "timestamp", utime);
  out.field("frame_id", frame);
}

std::string end_message(JsonText& out) {
  out.end_object();
  return out.take();
}

void transform_value(JsonText& out, model::Utime utime, std::string_view parent,
                     std::string_view child, const geometry::SE2& parent_T_child) {
  const double half = 0.5 * parent_T_child.theta();
  out.begin_object();
  time_field(out, "timestamp", utime);
  out.field("parent_frame_id", parent);
  out.field("child_frame_id", child);
  vector_field(out, "translation", {parent_T_child.x(), parent_T_child.y(), 0.0});
  quaternion_field(out, "rotation", {std::cos(half), 0.0, 0.0, std::sin(half)});
  out.end_object();
}

void numbers_field(JsonText& out, std::string_view name, std::span<const float> numbers) {
  out.key(name);
  out.begin_array();
  for (const float number : numbers) out.value(rounded(number));
  out.end_array();
}

void append_float(std::string& out, float value) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof(float)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(float));
  out.append(bytes.data(), bytes.size());
}

/// Packs every `step`-th point.
std::string packed_points(const std::vector<model::SweepPoint>& points, std::size_t step) {
  std::string bytes;
  bytes.reserve(kPointBytes * (points.size() / step + 1));
  for (std::size_t i = 0; i < points.size(); i += step) {
    append_float(bytes, points[i].x_m);
    append_float(bytes, points[i].y_m);
    append_float(bytes, points[i].z_m);
    bytes.push_back(static_cast<char>(points[i].intensity));
  }
  return bytes;
}

void packed_field(JsonText& out, std::string_view name, int offset, int type) {
  out.begin_object();
  out.field("name", name);
  out.field("offset", offset);
  out.field("type", type);
  out.end_object();
}

}  // namespace

std::string pose_in_frame(model::Utime utime, std::string_view frame, const geometry::SE2& pose) {
  JsonText out;
  begin_message(out, utime, frame);
  out.key("pose");
  pose_value(out, pose);
  return end_message(out);
}

std::string poses_in_frame(model::Utime utime, std::string_view frame,
                           std::span<const geometry::SE2> poses) {
  JsonText out;
  begin_message(out, utime, frame);
  out.key("poses");
  out.begin_array();
  for (const geometry::SE2& pose : poses) pose_value(out, pose);
  out.end_array();
  return end_message(out);
}

std::string frame_transforms(model::Utime utime, std::span<const FrameLink> links) {
  JsonText out;
  out.begin_object();
  out.key("transforms");
  out.begin_array();
  for (const FrameLink& link : links) {
    transform_value(out, utime, link.parent, link.child, link.parent_T_child);
  }
  out.end_array();
  return end_message(out);
}

std::string frame_transforms(const model::MapCorrection& correction) {
  JsonText out;
  out.begin_object();
  out.key("transforms");
  out.begin_array();
  for (const model::SubmapPose& one : correction.submaps) {
    transform_value(out, correction.utime, kMapFrame, submap_frame(one.id), one.map_T_submap);
  }
  out.end_array();
  return end_message(out);
}

std::string laser_scan(const lidar_scan_t& scan) {
  JsonText out;
  begin_message(out, scan.utime, kVehicleFrame);
  out.key("pose");
  pose_value(out, wire::from_wire(scan.vehicle_T_sensor));
  out.field("start_angle", scan.start_angle_rad);
  out.field("end_angle",
            scan.start_angle_rad + scan.angle_step_rad * std::max(0, scan.num_ranges - 1));
  numbers_field(out, "ranges", scan.ranges_m);
  numbers_field(out, "intensities", scan.intensities);
  return end_message(out);
}

std::string point_cloud(const model::PointSweep& sweep, std::size_t most_points) {
  const std::size_t step = std::max<std::size_t>(
      1, (sweep.points.size() + most_points - 1) / std::max<std::size_t>(1, most_points));
  JsonText out;
  begin_message(out, sweep.utime, kVehicleFrame);
  out.key("pose");
  out.begin_object();
  vector_field(out, "position", Eigen::Vector3d::Zero());
  quaternion_field(out, "orientation",
                   sweep.attitude ? sweep.attitude->level_Q_vehicle.normalized()
                                  : Eigen::Quaterniond::Identity());
  out.end_object();

  out.field("point_stride", kPointBytes);
  out.key("fields");
  out.begin_array();
  packed_field(out, "x", 0, kFloat32);
  packed_field(out, "y", 4, kFloat32);
  packed_field(out, "z", 8, kFloat32);
  packed_field(out, "intensity", 12, kUint8);
  out.end_array();
  out.key("data");
  out.base64(packed_points(sweep.points, step));
  return end_message(out);
}

std::string detections_scene(const model::LandmarkScan& scan) {
  std::vector<DrawnLandmark> landmarks;
  landmarks.reserve(scan.detections.size());
  for (const model::Detection& one : scan.detections) {
    landmarks.push_back(
        {one.position_m.head<2>(), one.radius_m, one.kind, Color{0.1, 0.5, 1.0, 0.8}});
  }
  return scene_of(scan.utime, kVehicleFrame, "detections", landmarks);
}

std::string truth_scene(const truth_landmarks_t& truth) {
  std::vector<DrawnLandmark> landmarks;
  landmarks.reserve(truth.landmarks.size());
  for (const truth_landmark_t& one : truth.landmarks) {
    const bool is_corner = one.kind == static_cast<std::int8_t>(model::LandmarkKind::kCorner);
    landmarks.push_back({{one.position_m[0], one.position_m[1]},
                         one.radius_m,
                         is_corner ? model::LandmarkKind::kCorner : model::LandmarkKind::kTrunk,
                         Color{1.0, 1.0, 1.0, 0.3}});
  }
  return scene_of(truth.utime, "world", "truth", landmarks);
}

std::string log_line(const log_t& line) {
  const bool is_known = line.level >= log_t::LEVEL_DEBUG && line.level <= log_t::LEVEL_ERROR;
  std::string text = terminal::printable(line.text);
  if (!line.code.empty()) text += " [" + terminal::printable(line.code) + "]";

  JsonText out;
  out.begin_object();
  time_field(out, "timestamp", line.utime);
  out.field("level", is_known ? line.level + 1 : 0);
  out.field("message", text);
  out.field("name", terminal::printable(line.process));
  out.field("file", terminal::printable(line.channel));
  out.field("line", 0);
  return end_message(out);
}

std::string location_fix(const gnss_t& fix) {
  const double variance = fix.sigma_m * fix.sigma_m;
  JsonText out;
  begin_message(out, fix.utime, kVehicleFrame);
  out.field("latitude", fix.latitude_deg);
  out.field("longitude", fix.longitude_deg);
  out.field("altitude", fix.altitude_m);
  out.key("position_covariance");
  out.begin_array();
  // The height has no stated covariance.
  for (int i = 0; i < 9; ++i) out.value(i == 0 || i == 4 ? variance : 0.0);
  out.end_array();
  out.field("position_covariance_type", fix.sigma_m > 0.0 ? 1 : 0);
  if (fix.has_velocity != 0) {
    vector_field(out, "velocity", {fix.east_velocity_m_s, fix.north_velocity_m_s, 0.0});
  }
  return end_message(out);
}

}  // namespace understory::foxglove
