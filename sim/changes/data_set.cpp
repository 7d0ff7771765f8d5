#include "sim/changes/data_set.hpp"

#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/io/output_file.hpp"
#include "sim/changes/drive_tables.hpp"

namespace understory::sim::changes {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kFormatName = "understory changed drives";
constexpr int kFormatVersion = 1;
constexpr std::string_view kManifestName = "manifest.json";
constexpr std::string_view kReadMeName = "README.txt";
constexpr double kSurfacePerM2 = 100.0;

constexpr std::string_view kReadMe =
    R"(One path through several copies of a simulated world, with the truth of what changed.

copy_0 is the unchanged world, where a map is made; in copy_1, copy_2, ... things were removed, moved
and added, and lorries (in rooms: carts) were parked that hide others. The body's path is the same in
all copies, to the bit. Units are m, rad, px; utime is in microseconds. Frame world: x east, y north,
z up. Frame camera: x right, y down, z ahead, origin in the left one of two rectified pinhole cameras.
An object's id (object_id) is the same in every copy and never another object's; 0 is the ground, or
none. A point is a spot of texture on an object; its id (point_id) is object_id * 2^20 + a number, and
goes where the object goes.

manifest.json     what was simulated, the camera's parameters, and all files with their sizes.
In each copy:
  drive.lcm         LIDAR, IMU (and wheels in the forest) as messages of Understory: RAW_SWEEP, RAW_IMU,
                    RAW_WHEELS; GROUND_TRUTH is the vehicle's pose in the plan. Left out on request.
  poses.csv         true world_T_camera of every frame: position, unit quaternion.
  keypoints.csv     what the detector gave: pixel in the left image, disparity, descriptor of 256 bits
                    in hexadecimal digits. Nothing in it tells which point it is.
  segmentation.csv  truth: object and point behind each keypoint (0: a false one), keypoints counted
                    from 0 in each frame. object_id is what a segmentation camera would show.
  expected.csv      truth, frame by frame: the points of copy_0 in the frustum (and not too oblique),
                    then new ones that are visible. sight: visible, hidden (in copy_0, too),
                    newly_hidden (not so in copy_0), gone (not there any more), new. was_visible: so in
                    copy_0, from the same pose. occluder_id: what is in front. range_m: from the
                    camera to where the point is, or was. measured_m: range of the first surface on
                    that line of sight, as a laser would measure it without noise; 0: none.
  points.csv        truth of all points. state: present, gone, moved, new, newly_hidden (present, but
                    visible from nowhere on the path, where in copy_0 it was). x_m.. is where it is
                    (gone: was); before_x_m.. where it was in copy_0; frames in which it was visible
                    in copy_0, is visible where it is now, is newly hidden. descriptor: without noise.
  objects.csv       truth of all objects: state present, gone, moved (by_x_m..) or new; the centre.
  surface.pcd       the copy as a scanner would map it: points on all surfaces but leaves, branches and
                    lids of tanks, a tenth as many on the ground; label is object_id.
)";

Json json_of(const CameraParameters& c) {
  Json rotation = Json::array();
  for (int row = 0; row < 4; ++row) {
    Json line = Json::array();
    for (int column = 0; column < 4; ++column)
      line.push_back(c.body_T_camera.matrix()(row, column));
    rotation.push_back(line);
  }
  return {{"width_px", c.width_px},
          {"height_px", c.height_px},
          {"focal_px", c.focal_px},
          {"baseline_m", c.baseline_m},
          {"rate_hz", c.rate_hz},
          {"near_m", c.near_m},
          {"far_m", c.far_m},
          {"most_oblique_rad", c.most_oblique_rad},
          {"recall", c.recall},
          {"recall_loss_far", c.recall_loss_far},
          {"false_per_frame", c.false_per_frame},
          {"pixel_sigma", c.pixel_sigma},
          {"disparity_sigma", c.disparity_sigma},
          {"flip_rate", c.flip_rate},
          {"flip_rate_oblique", c.flip_rate_oblique},
          {"body_T_camera", rotation}};
}

std::string copy_name(int copy) { return fmt::format("copy_{}", copy); }

std::uint64_t size_of(const std::filesystem::path& file) {
  std::error_code failed;
  const auto bytes = std::filesystem::file_size(file, failed);
  if (failed) throw io::DataError(fmt::format("{}: {}", file.string(), failed.message()));
  return bytes;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    throw io::DataError(fmt::format("{}: cannot be made: {}", folder.string(), failed.message()));
}

}  // namespace

std::string pcd_of(const std::vector<MappedPoint>& cloud) {
  std::string text = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z label\n"
      "SIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      cloud.size());
  for (const MappedPoint& point : cloud) {
    char bytes[16];
    std::memcpy(bytes, point.position_m.data(), 12);
    std::memcpy(bytes + 12, &point.thing, 4);
    text.append(bytes, sizeof bytes);
  }
  return text;
}

DataSetWriter::DataSetWriter(std::filesystem::path folder, DataSetInfo info)
    : folder_(std::move(folder)), info_(std::move(info)) {
  make_folder(folder_);
  std::error_code failed;
  const bool is_empty = std::filesystem::is_empty(folder_, failed);
  if (failed || !is_empty)
    throw io::DataError(fmt::format("{}: is not an empty folder", folder_.string()));
}

DataSetWriter::~DataSetWriter() {
  if (is_whole_) return;
  std::error_code ignored;  // a destructor cannot report errors
  for (int copy = 0; copy < copies_; ++copy)
    std::filesystem::remove_all(folder_ / copy_name(copy), ignored);
  std::filesystem::remove(folder_ / kReadMeName, ignored);
}

void DataSetWriter::write(std::string_view name, std::string_view text) {
  io::write_whole_file(path_in_copy(name), text);
  add_file(name);
}

std::filesystem::path DataSetWriter::path_in_copy(std::string_view name) const {
  return folder_ / copy_name(copies_ - 1) / name;
}

void DataSetWriter::add_file(std::string_view name) {
  files_.push_back(
      {fmt::format("{}/{}", copy_name(copies_ - 1), name), size_of(path_in_copy(name))});
}

void DataSetWriter::add(const ChangedDrive& drive, const Stage& copy) {
  make_folder(folder_ / copy_name(copies_++));
  write("poses.csv", text_of_poses(drive.frames));
  write("keypoints.csv", text_of_keypoints(drive.frames));
  write("segmentation.csv", text_of_segmentation(drive.frames));
  write("expected.csv", text_of_expected(drive.frames));
  write("points.csv", text_of_points(drive.points));
  write("objects.csv", text_of_things(drive.things));
  write("surface.pcd", pcd_of(sampled_surface(copy.scene, copy.built, kSurfacePerM2)));
}

void DataSetWriter::commit() {
  io::write_whole_file(folder_ / kReadMeName, kReadMe);
  Json files = Json::array();
  for (const DataSetFile& file : files_)
    files.push_back({{"name", file.name}, {"bytes", file.bytes}});
  const Json manifest{{"format", kFormatName},
                      {"version", kFormatVersion},
                      {"world", to_string(info_.scene)},
                      {"seed", info_.seed},
                      {"copies", copies_},
                      {"share_changed", info_.share},
                      {"move_m", info_.move_m},
                      {"descriptor_bits", 64 * Descriptor{}.size()},
                      {"body", "5 degrees of freedom: x, y, z, yaw, pitch; roll is not free"},
                      {"camera", json_of(info_.camera)},
                      {"files", files}};
  io::write_whole_file(folder_ / kManifestName, manifest.dump(2) + "\n");
  is_whole_ = true;
}

}  // namespace understory::sim::changes
