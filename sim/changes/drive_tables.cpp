#include "sim/changes/drive_tables.hpp"

#include <fmt/format.h>

#include <iterator>
#include <string_view>
#include <utility>

namespace understory::sim::changes {
namespace {

constexpr std::string_view kPosesHeading = "utime,x_m,y_m,z_m,qx,qy,qz,qw";
constexpr std::string_view kKeypointsHeading = "utime,u_px,v_px,disparity_px,descriptor";
constexpr std::string_view kSegmentationHeading = "utime,keypoint,object_id,point_id";
constexpr std::string_view kExpectedHeading =
    "utime,point_id,sight,was_visible,is_detected,occluder_id,range_m,measured_m";
constexpr std::string_view kPointsHeading =
    "point_id,object_id,state,x_m,y_m,z_m,before_x_m,before_y_m,before_z_m,normal_x,normal_y,"
    "normal_z,frames_before,frames_visible,frames_hidden,descriptor";
constexpr std::string_view kThingsHeading = "object_id,kind,state,by_x_m,by_y_m,by_z_m,x_m,y_m,z_m";

template <typename... Values>
void append(std::string& text, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Values>(values)...);
}

std::string hex_of(const Descriptor& d) {
  return fmt::format("{:016x}{:016x}{:016x}{:016x}", d[0], d[1], d[2], d[3]);
}

}  // namespace

std::string text_of_poses(std::span<const CameraFrame> frames) {
  std::string text = fmt::format("{}\n", kPosesHeading);
  for (const CameraFrame& frame : frames) {
    const Eigen::Vector3d p = frame.world_T_camera.translation();
    const Eigen::Quaterniond q(frame.world_T_camera.linear());
    append(text, "{},{},{},{},{},{},{},{}\n", frame.utime, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(),
           q.w());
  }
  return text;
}

std::string text_of_keypoints(std::span<const CameraFrame> frames) {
  std::string text = fmt::format("{}\n", kKeypointsHeading);
  for (const CameraFrame& frame : frames) {
    for (const Keypoint& k : frame.keypoints)
      append(text, "{},{},{},{},{}\n", frame.utime, k.pixel.x(), k.pixel.y(), k.disparity_px,
             hex_of(k.descriptor));
  }
  return text;
}

std::string text_of_segmentation(std::span<const CameraFrame> frames) {
  std::string text = fmt::format("{}\n", kSegmentationHeading);
  for (const CameraFrame& frame : frames) {
    for (std::size_t i = 0; i < frame.keypoints.size(); ++i)
      append(text, "{},{},{},{}\n", frame.utime, i, frame.keypoints[i].thing,
             frame.keypoints[i].point);
  }
  return text;
}

std::string text_of_expected(std::span<const CameraFrame> frames) {
  std::string text = fmt::format("{}\n", kExpectedHeading);
  for (const CameraFrame& frame : frames) {
    for (const ExpectedPoint& e : frame.expected)
      append(text, "{},{},{},{:d},{:d},{},{},{}\n", frame.utime, e.point, to_string(e.sight),
             e.was_visible, e.is_detected, e.occluder, e.range_m, e.measured_m);
  }
  return text;
}

std::string text_of_points(std::span<const TruePoint> points) {
  std::string text = fmt::format("{}\n", kPointsHeading);
  for (const TruePoint& p : points) {
    append(text, "{},{},{},", p.id, thing_of(p.id), to_string(p.state));
    for (const Eigen::Vector3d& v : {p.position_m, p.before_m, p.normal})
      append(text, "{},{},{},", v.x(), v.y(), v.z());
    append(text, "{},{},{},{}\n", p.frames_before, p.frames_visible, p.frames_hidden,
           hex_of(p.descriptor));
  }
  return text;
}

std::string text_of_things(std::span<const TrueThing> things) {
  std::string text = fmt::format("{}\n", kThingsHeading);
  for (const TrueThing& t : things)
    append(text, "{},{},{},{},{},{},{},{},{}\n", t.id, to_string(t.kind), to_string(t.state),
           t.by_m.x(), t.by_m.y(), t.by_m.z(), t.centre_m.x(), t.centre_m.y(), t.centre_m.z());
  return text;
}

}  // namespace understory::sim::changes
