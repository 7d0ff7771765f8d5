// A data set as others read it.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/bag/cloud_decoder.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/io/text_file.hpp"
#include "sim/changes/data_set.hpp"
#include "sim/changes/drive_tables.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"
#include "tests/sim_changes/changes_fixture.hpp"

using namespace understory;
using namespace understory::sim::changes;
using Catch::Matchers::Contains;
using understory::test::course_of;
using understory::test::Scratch;
using understory::test::slow_camera;

namespace {

struct Written {
  CameraParameters camera = slow_camera(SceneKind::kOffice);
  Course course = course_of(SceneKind::kOffice);
  Replay unchanged{course, {}};
  Replay changed{course, make_diff(course, {}, 3)};
  ChangedDrive before = unchanged.drive(camera, 1);
  ChangedDrive after = changed.drive(camera, 2);

  void write(const std::filesystem::path& folder) const {
    DataSetWriter writer(folder, {SceneKind::kOffice, 7, 0.2, 0.5, camera});
    writer.add(before, unchanged.copy());
    writer.add(after, changed.copy());
    writer.commit();
  }
};

std::string all_texts(const ChangedDrive& drive) {
  return text_of_poses(drive.frames) + text_of_keypoints(drive.frames) +
         text_of_segmentation(drive.frames) + text_of_expected(drive.frames) +
         text_of_points(drive.points) + text_of_things(drive.things);
}

/// Cells of each row, without the heading.
using Table = std::vector<std::vector<std::string>>;

Table table_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  Table table;
  std::string line;
  std::getline(in, line);
  const auto columns = std::ranges::count(line, ',') + 1;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    auto& row = table.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    REQUIRE(static_cast<std::ptrdiff_t>(row.size()) == columns);
  }
  return table;
}

double number(const std::string& cell) { return std::strtod(cell.c_str(), nullptr); }

Descriptor descriptor_of(const std::string& digits) {
  Descriptor descriptor{};
  REQUIRE(digits.size() == 16 * descriptor.size());
  for (std::size_t word = 0; word < descriptor.size(); ++word)
    descriptor[word] = std::stoull(digits.substr(16 * word, 16), nullptr, 16);
  return descriptor;
}

}  // namespace

TEST_CASE("the same seed gives the same bytes, another seed others") {
  const Written a, b;
  CHECK(all_texts(a.after) == all_texts(b.after));
  CHECK(all_texts(a.after) != all_texts(a.before));
  CHECK(text_of_keypoints(a.changed.drive(a.camera, 3).frames) !=
        text_of_keypoints(a.after.frames));
  CHECK(pcd_of(sampled_surface(a.changed.copy().scene, a.changed.copy().built, 20.0)) ==
        pcd_of(sampled_surface(b.changed.copy().scene, b.changed.copy().built, 20.0)));
}

TEST_CASE("a frame depends on nothing that was asked before") {
  const Written data;
  KeypointCamera camera = data.changed.look(data.camera, 2);
  const auto stops = data.changed.stops(data.camera);
  const std::size_t last = stops.size() - 1;
  const CameraFrame alone = camera.frame(stops[last].world_T_body, last, stops[last].utime);
  CHECK(text_of_keypoints(std::span(&alone, 1)) ==
        text_of_keypoints(std::span(data.after.frames).last(1)));
}

TEST_CASE("the tables give every number back as it was") {
  const Written data;
  const Scratch scratch("data-set");
  const auto folder = scratch.path() / "set";
  data.write(folder);

  const Table poses = table_of(folder / "copy_1" / "poses.csv");
  const Table keypoints = table_of(folder / "copy_1" / "keypoints.csv");
  const Table segmentation = table_of(folder / "copy_1" / "segmentation.csv");
  REQUIRE(poses.size() == data.after.frames.size());
  std::size_t row = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const CameraFrame& frame = data.after.frames[i];
    const auto& pose = poses[i];
    const Eigen::Quaterniond q(number(pose[7]), number(pose[4]), number(pose[5]), number(pose[6]));
    CHECK(pose[0] == std::to_string(frame.utime));
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      CHECK(number(pose[static_cast<std::size_t>(axis) + 1]) ==
            frame.world_T_camera.translation()[axis]);
    CHECK(q.toRotationMatrix().isApprox(frame.world_T_camera.linear(), 1e-14));
    for (std::size_t k = 0; k < frame.keypoints.size(); ++k, ++row) {
      const Keypoint& made = frame.keypoints[k];
      REQUIRE(row < std::min(keypoints.size(), segmentation.size()));
      REQUIRE(keypoints[row][0] == pose[0]);
      REQUIRE(number(keypoints[row][1]) == made.pixel.x());
      REQUIRE(number(keypoints[row][2]) == made.pixel.y());
      REQUIRE(number(keypoints[row][3]) == made.disparity_px);
      REQUIRE(descriptor_of(keypoints[row][4]) == made.descriptor);
      REQUIRE(segmentation[row] == std::vector{pose[0], std::to_string(k),
                                               std::to_string(made.thing),
                                               std::to_string(made.point)});
    }
  }
  CHECK(row == keypoints.size());
  CHECK(row == segmentation.size());

  const Table expected = table_of(folder / "copy_1" / "expected.csv");
  row = 0;
  for (const CameraFrame& frame : data.after.frames) {
    for (const ExpectedPoint& made : frame.expected) {
      REQUIRE(row < expected.size());
      REQUIRE(expected[row][1] == std::to_string(made.point));
      REQUIRE(expected[row][2] == to_string(made.sight));
      REQUIRE(static_cast<float>(number(expected[row][6])) == made.range_m);
      ++row;
    }
  }
  CHECK(row == expected.size());

  const Table points = table_of(folder / "copy_1" / "points.csv");
  REQUIRE(points.size() == data.after.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    REQUIRE(points[i][0] == std::to_string(data.after.points[i].id));
    REQUIRE(points[i][2] == to_string(data.after.points[i].state));
    REQUIRE(number(points[i][5]) == data.after.points[i].position_m.z());
    REQUIRE(descriptor_of(points[i][15]) == data.after.points[i].descriptor);
  }
  const Table things = table_of(folder / "copy_1" / "objects.csv");
  REQUIRE(things.size() == data.after.things.size());
  for (std::size_t i = 0; i < things.size(); ++i) {
    REQUIRE(things[i][0] == std::to_string(data.after.things[i].id));
    REQUIRE(things[i][2] == to_string(data.after.things[i].state));
    REQUIRE(number(things[i][8]) == data.after.things[i].centre_m.z());
  }
}

TEST_CASE("a data set has a manifest, a cloud of each copy and a text that explains the files") {
  const Written data;
  const Scratch scratch("data-set-manifest");
  const auto folder = scratch.path() / "set";
  data.write(folder);
  const auto manifest = nlohmann::json::parse(io::read_whole_file(folder / "manifest.json"));
  CHECK(manifest.at("copies") == 2);
  CHECK(manifest.at("world") == "office");
  CHECK(manifest.at("seed") == 7);
  CHECK(manifest.at("camera").at("focal_px") == data.camera.focal_px);
  CHECK(manifest.at("files").size() == 14);
  for (const auto& file : manifest.at("files"))
    CHECK(std::filesystem::file_size(folder / file.at("name").get<std::string>()) ==
          file.at("bytes").get<std::uintmax_t>());

  const auto file = folder / "copy_1" / "surface.pcd";
  const bag::CloudFile pcd = bag::parse_pcd(io::read_whole_file(file), file.string());
  const model::PointSweep cloud = bag::CloudDecoder().decode(pcd.cloud);
  const auto sampled = sampled_surface(data.changed.copy().scene, data.changed.copy().built, 100.0);
  REQUIRE(cloud.points.size() == sampled.size());
  CHECK(cloud.points.back().position() == sampled.back().position_m);
  CHECK_THAT(io::read_whole_file(folder / "README.txt"), Contains("keypoints.csv"));
}

TEST_CASE("nothing in the keypoints' table tells which point it is") {
  const Written data;
  const std::string text = text_of_keypoints(data.after.frames);
  CHECK(text.starts_with("utime,u_px,v_px,disparity_px,descriptor\n"));
}

TEST_CASE("without commit nothing is left behind") {
  const Written data;
  const Scratch scratch("data-set-half");
  {
    DataSetWriter writer(scratch.path(), {SceneKind::kOffice, 7, 0.2, 0.5, data.camera});
    writer.add(data.before, data.unchanged.copy());
    CHECK_FALSE(std::filesystem::is_empty(scratch.path()));
  }
  CHECK(std::filesystem::is_empty(scratch.path()));
}

TEST_CASE("a folder that has something already is refused") {
  const Written data;
  const Scratch scratch("data-set-folder");
  std::ofstream(scratch.path() / "manifest.json") << "{}";
  CHECK_THROWS_WITH(data.write(scratch.path()), Contains("not an empty folder"));
}
