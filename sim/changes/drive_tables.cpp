#include "sim/changes/drive_tables.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "sim/changes/table.hpp"

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
constexpr std::size_t kDescriptorDigits = 64;

template <typename... Values>
void append(std::string& text, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Values>(values)...);
}

std::string hex_of(const Descriptor& d) {
  return fmt::format("{:016x}{:016x}{:016x}{:016x}", d[0], d[1], d[2], d[3]);
}

Descriptor descriptor_of(const TableReader& row, std::size_t column) {
  if (row.text(column).size() != kDescriptorDigits)
    row.refuse_cell(column, "descriptor of 64 hexadecimal digits");
  return {row.hexadecimal(column, 0), row.hexadecimal(column, 1), row.hexadecimal(column, 2),
          row.hexadecimal(column, 3)};
}

Eigen::Vector3d vector_of(const TableReader& row, std::size_t first_column) {
  return {row.number(first_column), row.number(first_column + 1), row.number(first_column + 2)};
}

template <typename Kind>
Kind named(const TableReader& row, std::size_t column, std::optional<Kind> kind,
           std::string_view wanted) {
  if (!kind) row.refuse_cell(column, wanted);
  return *kind;
}

template <typename Number>
Number small_count(const TableReader& row, std::size_t column) {
  const std::uint64_t value = row.count(column);
  if (value > std::numeric_limits<Number>::max()) row.refuse_cell(column, "number of that size");
  return static_cast<Number>(value);
}

bool flag(const TableReader& row, std::size_t column) {
  const std::uint64_t value = row.count(column);
  if (value > 1) row.refuse_cell(column, "0 or 1");
  return value == 1;
}

/// Follows the frames in the order of a table's rows, by time.
class FrameCursor {
 public:
  explicit FrameCursor(std::vector<CameraFrame>& frames) : frames_(frames) {}

  CameraFrame& at(const TableReader& row) {
    const std::int64_t utime = row.integer(0);
    while (next_ < frames_.size() && frames_[next_].utime < utime) ++next_;
    if (next_ == frames_.size() || frames_[next_].utime != utime)
      row.refuse(fmt::format("utime {} is that of no frame, or out of order", utime));
    return frames_[next_];
  }

 private:
  std::vector<CameraFrame>& frames_;
  std::size_t next_ = 0;
};

std::vector<CameraFrame> parse_poses(const DriveTexts::Text& text) {
  constexpr double kQuaternionTolerance = 1e-6;
  std::vector<CameraFrame> frames;
  TableReader row(text.text, text.source, kPosesHeading);
  while (row.next()) {
    CameraFrame frame;
    frame.utime = row.integer(0);
    frame.number = frames.size();
    if (!frames.empty() && frame.utime <= frames.back().utime)
      row.refuse("utime is not after the one before");
    const Eigen::Quaterniond rotation(row.number(7), row.number(4), row.number(5), row.number(6));
    if (std::abs(rotation.norm() - 1.0) > kQuaternionTolerance)
      row.refuse(fmt::format("the quaternion's length is {:.6f}, not 1", rotation.norm()));
    frame.world_T_camera.linear() = rotation.normalized().toRotationMatrix();
    frame.world_T_camera.translation() = vector_of(row, 1);
    frames.push_back(frame);
  }
  return frames;
}

void parse_keypoints(const DriveTexts::Text& text, std::vector<CameraFrame>& frames) {
  FrameCursor cursor(frames);
  TableReader row(text.text, text.source, kKeypointsHeading);
  while (row.next()) {
    Keypoint keypoint;
    keypoint.pixel = {row.number(1), row.number(2)};
    keypoint.disparity_px = row.number(3);
    keypoint.descriptor = descriptor_of(row, 4);
    cursor.at(row).keypoints.push_back(keypoint);
  }
}

void parse_segmentation(const DriveTexts::Text& text, std::vector<CameraFrame>& frames) {
  FrameCursor cursor(frames);
  TableReader row(text.text, text.source, kSegmentationHeading);
  std::size_t rows = 0;
  while (row.next()) {
    CameraFrame& frame = cursor.at(row);
    const std::uint64_t index = row.count(1);
    if (index >= frame.keypoints.size())
      row.refuse(fmt::format("the frame has {} keypoints", frame.keypoints.size()));
    frame.keypoints[index].thing = small_count<ThingId>(row, 2);
    frame.keypoints[index].point = row.count(3);
    ++rows;
  }

  std::size_t keypoints = 0;
  for (const CameraFrame& frame : frames) keypoints += frame.keypoints.size();
  if (rows != keypoints) row.refuse(fmt::format("{} rows for {} keypoints", rows, keypoints));
}

void parse_expected(const DriveTexts::Text& text, std::vector<CameraFrame>& frames) {
  FrameCursor cursor(frames);
  TableReader row(text.text, text.source, kExpectedHeading);
  while (row.next()) {
    ExpectedPoint expected;
    expected.point = row.count(1);
    expected.sight = named(row, 2, sight_of_name(row.text(2)), "sight");
    expected.was_visible = flag(row, 3);
    expected.is_detected = flag(row, 4);
    expected.occluder = small_count<ThingId>(row, 5);
    expected.range_m = static_cast<float>(row.number(6));
    expected.measured_m = static_cast<float>(row.number(7));
    cursor.at(row).expected.push_back(expected);
  }
}

std::vector<TruePoint> parse_points(const DriveTexts::Text& text) {
  std::vector<TruePoint> points;
  TableReader row(text.text, text.source, kPointsHeading);
  while (row.next()) {
    TruePoint point;
    point.id = row.count(0);
    if (!points.empty() && point.id <= points.back().id)
      row.refuse("point_id is not above the one before");
    if (row.count(1) != thing_of(point.id)) row.refuse_cell(1, "object of that point");
    point.state = named(row, 2, point_state(row.text(2)), "state of a point");
    point.position_m = vector_of(row, 3);
    point.before_m = vector_of(row, 6);
    point.normal = vector_of(row, 9);
    point.frames_before = small_count<std::uint32_t>(row, 12);
    point.frames_visible = small_count<std::uint32_t>(row, 13);
    point.frames_hidden = small_count<std::uint32_t>(row, 14);
    point.descriptor = descriptor_of(row, 15);
    points.push_back(point);
  }
  return points;
}

std::vector<TrueThing> parse_things(const DriveTexts::Text& text) {
  std::vector<TrueThing> things;
  TableReader row(text.text, text.source, kThingsHeading);
  while (row.next()) {
    TrueThing thing;
    thing.id = small_count<ThingId>(row, 0);
    if (!things.empty() && thing.id <= things.back().id)
      row.refuse("object_id is not above the one before");
    thing.kind = named(row, 1, thing_kind(row.text(1)), "kind of object");
    thing.state = named(row, 2, thing_state(row.text(2)), "state of an object");
    thing.by_m = vector_of(row, 3);
    thing.centre_m = vector_of(row, 6);
    things.push_back(thing);
  }
  return things;
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

ChangedDrive parse_drive(const DriveTexts& texts, const CameraParameters& camera) {
  ChangedDrive drive;
  drive.camera = camera;
  drive.frames = parse_poses(texts.poses);
  parse_keypoints(texts.keypoints, drive.frames);
  parse_segmentation(texts.segmentation, drive.frames);
  parse_expected(texts.expected, drive.frames);
  drive.points = parse_points(texts.points);
  drive.things = parse_things(texts.things);
  return drive;
}

}  // namespace understory::sim::changes
