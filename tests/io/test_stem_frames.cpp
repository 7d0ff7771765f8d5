// Folders of stem tables: what is read, what is refused, and that what is written is read back.
#include "common/io/stem_frames.hpp"

#include <fmt/format.h>

#include <random>

#include "common/io/data_error.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using Catch::Matchers::Contains;

namespace {

void write_stem_text(const std::filesystem::path& file, const std::string& text) {
  test::write_bytes(file, test::Bytes(text.begin(), text.end()));
}

std::string refusal(const std::function<void()>& reading) {
  try {
    reading();
  } catch (const io::DataError& error) {
    return error.what();
  }
  return "";
}

std::string refused_stems(const std::string& text) {
  return refusal([&] { io::parse_stems(text, "frame_3.csv"); });
}

std::string refused_trajectory(const std::string& text) {
  return refusal([&] { io::parse_stem_trajectory(text, "trajectory.txt"); });
}

/// Attitudes with roll and pitch of up to 0.4 rad, everything else up to what a drive has.
std::vector<model::StemFrame> random_frames(std::mt19937_64& random, std::size_t count) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<model::StemFrame> frames(count);
  for (std::size_t i = 0; i < count; ++i) {
    frames[i].utime = 1'700'000'000'000'000 + static_cast<model::Utime>(i) * 1'234'567;
    frames[i].world_T_sensor.linear() =
        (Eigen::AngleAxisd(3.0 * unit(random), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(0.4 * unit(random), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(0.4 * unit(random), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    frames[i].world_T_sensor.translation() << 1e3 * unit(random), 1e3 * unit(random), unit(random);
    frames[i].stems.resize(i % 5);
    for (model::Stem& stem : frames[i].stems) {
      stem.position_m << 30.0 * unit(random), 30.0 * unit(random), unit(random);
      stem.axis = Eigen::Vector3d(0.1 * unit(random), 0.1 * unit(random), 1.0).normalized();
      stem.diameter_m = 0.4 + 0.3 * unit(random);
      stem.score = unit(random);
    }
  }
  return frames;
}

}  // namespace

TEST_CASE("A stem table is read by its heading, in any order of columns", "[stem-frames]") {
  const auto stems = io::parse_stems(
      "\xEF\xBB\xBF# a comment\r\n\r\ndbh_m,y_m,x_m,score\r\n0.31,2,1,0.5\r\n,-4,3.5,\r\n", "t");
  REQUIRE(stems.size() == 2);
  CHECK(stems[0].position_m == Eigen::Vector3d(1.0, 2.0, 0.0));
  CHECK(stems[0].diameter_m == 0.31);
  CHECK(stems[0].score == 0.5);
  CHECK(stems[0].axis.isZero());
  CHECK(stems[1].position_m == Eigen::Vector3d(3.5, -4.0, 0.0));
  CHECK(stems[1].diameter_m == 0.0);
  CHECK(io::parse_stems("x_m,y_m\n", "t").empty());
  CHECK(io::parse_stems("x_m,y_m,axis_x,axis_y,axis_z\n1,2,0,0,3", "t").front().axis ==
        Eigen::Vector3d::UnitZ());
}

TEST_CASE("Every fault of a stem table is one line that names file and line", "[stem-frames]") {
  struct Fault {
    std::string text;
    std::string says;
  };
  const Fault fault = GENERATE(
      Fault{"", "no heading"}, Fault{"\n# only this\n", "no heading"},
      Fault{"1,2\n3,4\n", "line 1: unknown column '1'"},
      Fault{"x_m,y_m,height\n", "line 1: unknown column 'height'"},
      Fault{"x_m\n1\n", "no column y_m"}, Fault{"x_m,y_m,x_m\n", "column x_m comes twice"},
      Fault{"x_m,y_m\n1,2\n3\n", "line 3: 1 cells"}, Fault{"x_m,y_m\n1,2,3\n", "line 2: 3 cells"},
      Fault{"x_m,y_m\n1,nan\n", "line 2: y_m 'nan'"}, Fault{"x_m,y_m\n\n1,\n", "line 3: y_m ''"},
      Fault{"x_m,y_m\n1e300,2\n", "line 2: x_m 1e+300"},
      Fault{"x_m,y_m\n1e400,2\n", "line 2: x_m '1e400'"},
      Fault{"x_m,y_m\n1001,2\n", "x_m 1001 is beyond 1000 m"},
      Fault{"x_m,y_m,dbh_m\n1,2,-0.1\n", "dbh_m -0.1 is negative"},
      Fault{"x_m,y_m,dbh_m\n1,2,inf\n", "dbh_m 'inf'"},
      Fault{"x_m,y_m,dbh_m\n1,2,21\n", "dbh_m 21"},
      Fault{"x_m,y_m,axis_x\n1,2,3\n", "come together"},
      Fault{"x_m,y_m,axis_x,axis_y,axis_z\n1,2,0,0,0\n", "line 2: the axis has no length"},
      Fault{"x_m,y_m,score\n1,2,1e300\n", "score 1e+300"});
  CAPTURE(fault.text);
  const std::string refused = refused_stems(fault.text);
  CHECK_THAT(refused, Contains("frame_3.csv"));
  CHECK_THAT(refused, Contains(fault.says));
  CHECK_THAT(refused, !Contains("\n"));
}

TEST_CASE("Every fault of a trajectory is one line that names file and line", "[stem-frames]") {
  struct Fault {
    std::string text;
    std::string says;
  };
  const std::string good = "10.5 1 2 3 0 0 0 1\n";
  const Fault fault = GENERATE_COPY(
      Fault{"1 2 3\n", "line 1: 3 values"}, Fault{good + "11 1 2 3 0 0 0 1 9", "9 values"},
      Fault{good + "# gap\n10.5 1 2 3 0 0 0 1", "line 3: stamp 10.500000 s is not after"},
      Fault{good + "9 1 2 3 0 0 0 1", "line 2: stamp 9.000000 s is not after"},
      Fault{"nan 1 2 3 0 0 0 1", "stamp 'nan'"}, Fault{"1 1e300 2 3 0 0 0 1", "x 1e+300"},
      Fault{"1e300 1 2 3 0 0 0 1", "stamp 1e+300"}, Fault{"1 x 2 3 0 0 0 1", "x 'x'"},
      Fault{"1 1 2 3 0 0 0 0", "the quaternion's length is 0.000"},
      Fault{"1 1 2 3 0.5 0 0 1", "the quaternion's length is 1.118"});
  CAPTURE(fault.text);
  const std::string refused = refused_trajectory(fault.text);
  CHECK_THAT(refused, Contains("trajectory.txt, line "));
  CHECK_THAT(refused, Contains(fault.says));
}

TEST_CASE("A folder of frames is read in the order of their numbers", "[stem-frames]") {
  const test::TemporaryDirectory folder;
  write_stem_text(folder / "trajectory.txt", "1 0 0 0 0 0 0 1\n2 5 0 0 0 0 0 1\n3 9 0 0 0 0 0 1\n");
  write_stem_text(folder / "frame_10.csv", "x_m,y_m\n10,0\n");
  write_stem_text(folder / "frame_2.csv", "x_m,y_m\n2,0\n");
  write_stem_text(folder / "frame_007.csv", "x_m,y_m\n7,0\n");
  write_stem_text(folder / "notes.txt", "not a frame");

  const auto frames = io::read_stem_frames(folder.path());
  REQUIRE(frames.size() == 3);
  CHECK(frames[0].stems.at(0).position_m.x() == 2.0);
  CHECK(frames[1].stems.at(0).position_m.x() == 7.0);
  CHECK(frames[2].stems.at(0).position_m.x() == 10.0);
  CHECK(frames[1].utime == 2'000'000);
  CHECK(frames[2].world_T_sensor.translation().x() == 9.0);

  const auto refused = [&] { return refusal([&] { io::read_stem_frames(folder.path()); }); };
  SECTION("another number of poses") {
    write_stem_text(folder / "frame_11.csv", "x_m,y_m\n");
    CHECK_THAT(refused(), Contains("trajectory.txt: 3 poses for 4 frames"));
  }
  SECTION("a number twice") {
    write_stem_text(folder / "frame_7.csv", "x_m,y_m\n");
    CHECK_THAT(refused(), Contains("frame 7 is there twice"));
  }
  SECTION("a frame without a number") {
    write_stem_text(folder / "frame_last.csv", "x_m,y_m\n");
    CHECK_THAT(refused(), Contains("frame_last.csv: no number"));
  }
  SECTION("no trajectory") {
    std::filesystem::remove(folder / "trajectory.txt");
    CHECK_THAT(refused(), Contains("trajectory.txt: cannot be read"));
  }
  SECTION("a frame that is a folder") {
    std::filesystem::remove(folder / "frame_2.csv");
    std::filesystem::create_directory(folder / "frame_2.csv");
    CHECK_THAT(refused(), Contains("frame_2.csv: cannot be read"));
  }
  SECTION("a fault inside a frame") {
    write_stem_text(folder / "frame_10.csv", "x_m,y_m\n10,0\nten,0\n");
    CHECK_THAT(refused(), Contains("frame_10.csv, line 3: x_m 'ten'"));
  }
}

TEST_CASE("An empty folder, a file and nothing at all are refused by name", "[stem-frames]") {
  const test::TemporaryDirectory folder;
  write_stem_text(folder / "file", "x");
  std::filesystem::create_directory(folder / "empty");
  const auto refused = [&](const char* name) {
    return refusal([&] { io::read_stem_frames(folder / name); });
  };
  CHECK_THAT(refused("empty"), Contains("empty: no frame_<n>.csv in the folder"));
  CHECK_THAT(refused("file"), Contains("file: cannot be read as a folder"));
  CHECK_THAT(refused("none"), Contains("none: cannot be read as a folder"));
}

TEST_CASE("What is written is read back", "[stem-frames]") {
  const test::TemporaryDirectory folder;
  std::mt19937_64 random(7);
  const auto frames = random_frames(random, 12);
  io::write_stem_frames(folder / "drive", frames);
  const auto again = io::read_stem_frames(folder / "drive");

  REQUIRE(again.size() == frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    CHECK(again[i].utime == frames[i].utime);
    CHECK(again[i].world_T_sensor.isApprox(frames[i].world_T_sensor, 1e-6));
    REQUIRE(again[i].stems.size() == frames[i].stems.size());
    for (std::size_t k = 0; k < frames[i].stems.size(); ++k) {
      const model::Stem &was = frames[i].stems[k], &is = again[i].stems[k];
      CHECK((was.position_m - is.position_m).norm() < 1e-4);
      CHECK((was.axis - is.axis).norm() < 1e-5);
      CHECK(std::abs(was.diameter_m - is.diameter_m) < 1e-4);
      CHECK(std::abs(was.score - is.score) < 1e-4);
    }
  }
  CHECK_THAT(refusal([&] { io::write_stem_frames(folder / "drive", frames); }),
             Contains("has frames already"));
}

TEST_CASE("Levelled stems stand where the world has them, whatever roll and pitch",
          "[stem-frames]") {
  std::mt19937_64 random(8);
  for (const model::StemFrame& frame : random_frames(random, 30)) {
    const model::LandmarkScan scan = model::level_scan(frame, 0.2, 50.0);
    REQUIRE(scan.detections.size() == frame.stems.size());
    CHECK(scan.field_of_view.max_range_m == 50.0);
    for (std::size_t k = 0; k < frame.stems.size(); ++k) {
      const Eigen::Vector3d in_world = frame.world_T_sensor * frame.stems[k].position_m;
      const Eigen::Vector2d level = scan.detections[k].position_m.head<2>();
      CHECK((model::level_pose(frame) * level - in_world.head<2>()).norm() < 1e-9);
      CHECK(scan.detections[k].radius_m == 0.5 * frame.stems[k].diameter_m);
      CHECK(scan.detections[k].covariance_m2(0, 0) == Approx(0.04));
    }
  }
}
