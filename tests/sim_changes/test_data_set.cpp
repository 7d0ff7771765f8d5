// A data set: written, read back, damaged.
#include <fstream>

#include "common/bag/cloud_decoder.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/io/data_error.hpp"
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

void overwrite(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
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

TEST_CASE("what was written is read back equal") {
  const Written data;
  const Scratch scratch("data-set");
  const auto folder = scratch.path() / "set";
  data.write(folder);
  const DataSetReader reader(folder);
  CHECK(reader.copies() == 2);
  CHECK(reader.info().scene == SceneKind::kOffice);
  CHECK(reader.info().seed == 7);
  CHECK(reader.info().camera.focal_px == data.camera.focal_px);
  CHECK(reader.info().camera.body_T_camera.matrix() == data.camera.body_T_camera.matrix());

  const ChangedDrive drive = reader.drive(1);
  REQUIRE(drive.frames.size() == data.after.frames.size());
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    REQUIRE(drive.frames[i].world_T_camera.isApprox(data.after.frames[i].world_T_camera, 1e-14));
    REQUIRE(drive.frames[i].keypoints.size() == data.after.frames[i].keypoints.size());
    for (std::size_t k = 0; k < drive.frames[i].keypoints.size(); ++k) {
      const Keypoint& read = drive.frames[i].keypoints[k];
      const Keypoint& made = data.after.frames[i].keypoints[k];
      REQUIRE(read.pixel == made.pixel);
      REQUIRE(read.disparity_px == made.disparity_px);
      REQUIRE(read.descriptor == made.descriptor);
      REQUIRE(read.point == made.point);
      REQUIRE(read.thing == made.thing);
    }
  }
  CHECK(text_of_expected(drive.frames) == text_of_expected(data.after.frames));
  CHECK(text_of_points(drive.points) == text_of_points(data.after.points));
  CHECK(text_of_things(drive.things) == text_of_things(data.after.things));

  const auto file = reader.whole_file(1, "surface.pcd");
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

TEST_CASE("a file that was cut off or changed is refused by its name, and by its line") {
  const Written data;
  const Scratch scratch("data-set-damage");
  const auto folder = scratch.path() / "set";
  data.write(folder);
  for (const char* name : {"poses.csv", "keypoints.csv", "segmentation.csv", "expected.csv",
                           "points.csv", "objects.csv"}) {
    const auto file = folder / "copy_1" / name;
    const std::string good = io::read_whole_file(file);
    for (const std::size_t size : {std::size_t{0}, good.size() / 2, good.size() - 1}) {
      overwrite(file, good.substr(0, size));
      CHECK_THROWS_WITH(DataSetReader(folder).drive(1), Contains(file.string()));
    }

    // Of the right size, but no number in the third line.
    std::string bad = good;
    bad[bad.find('\n', bad.find('\n') + 1) + 1] = 'x';
    overwrite(file, bad);
    CHECK_THROWS_WITH(DataSetReader(folder).drive(1), Contains(file.string() + ", line 3: "));
    std::filesystem::remove(file);
    CHECK_THROWS_WITH(DataSetReader(folder).drive(1), Contains(file.string()));
    overwrite(file, good);
  }
  CHECK_NOTHROW(DataSetReader(folder).drive(1));
  CHECK_THROWS_AS(DataSetReader(folder).drive(2), io::DataError);
}

TEST_CASE("a table that is cut at the end of a line disagrees with the others") {
  const Written data;
  const auto texts = [&] {
    return DriveTexts{{text_of_poses(data.after.frames), "poses"},
                      {text_of_keypoints(data.after.frames), "keypoints"},
                      {text_of_segmentation(data.after.frames), "segmentation"},
                      {text_of_expected(data.after.frames), "expected"},
                      {text_of_points(data.after.points), "points"},
                      {text_of_things(data.after.things), "objects"}};
  };
  const auto without_last_line = [](std::string& text) {
    text.resize(text.rfind('\n', text.size() - 2) + 1);
  };
  CHECK_NOTHROW(parse_drive(texts(), data.camera));
  DriveTexts cut = texts();
  without_last_line(cut.segmentation.text);
  CHECK_THROWS_WITH(parse_drive(cut, data.camera), Contains("segmentation, line"));
  cut = texts();
  without_last_line(cut.poses.text);
  CHECK_THROWS_WITH(parse_drive(cut, data.camera), Contains("keypoints, line"));
  cut = texts();
  cut.poses.text = "utime,x\n";
  CHECK_THROWS_WITH(parse_drive(cut, data.camera), Contains("poses, line 1"));
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

TEST_CASE("no data set where there is no manifest, another file, or something already") {
  const Written data;
  const Scratch scratch("data-set-folder");
  CHECK_THROWS_AS(DataSetReader(scratch.path()), io::DataError);
  overwrite(scratch.path() / "manifest.json", "{\"format\": \"another\", \"version\": 1}");
  CHECK_THROWS_WITH(DataSetReader(scratch.path()), Contains("manifest.json"));
  overwrite(scratch.path() / "manifest.json", "{\"format\": ");
  CHECK_THROWS_WITH(DataSetReader(scratch.path()), Contains("manifest.json"));
  CHECK_THROWS_WITH(data.write(scratch.path()), Contains("not an empty folder"));
}
