#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"
#include "common/io/victoria_park.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::io;
namespace fs = std::filesystem;

namespace {

/// A scan record as LASER.txt has it: the time, then 361 ranges, tabs, no line break.
std::string scan_record(const std::string& time, double range, std::size_t beams = 361) {
  std::string text = time;
  for (std::size_t i = 0; i < beams; ++i) {
    text += '\t';
    text += std::to_string(range);
  }
  text += '\t';
  return text;
}

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const DataError& error) {
    return error.what();
  }
  return {};
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

struct TemporaryFolder {
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "understory_vp_XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    path = name;
  }
  ~TemporaryFolder() { fs::remove_all(path); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  fs::path path;
};

void write_file(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

}  // namespace

TEST_CASE("laser records have no line breaks", "[victoria_park]") {
  const std::string text = scan_record("0.852", 5.0) + scan_record("1.066", 81.91);
  const auto scans = victoria_park::parse_laser(text, "LASER.txt");
  REQUIRE(scans.size() == 2);
  CHECK(scans[0].utime == 852'000);
  CHECK(scans[1].sequence == 1);
  REQUIRE(scans[0].ranges_m.size() == 361);
  CHECK(scans[0].is_return(0));
  CHECK_FALSE(scans[1].is_return(0));
  // Beam 0 to the right, 180 ahead, 360 to the left.
  CHECK(scans[0].bearing(0) == Approx(-1.5707963268));
  CHECK(scans[0].bearing(180) == Approx(0.0).margin(1e-12));
  CHECK(scans[0].bearing(360) == Approx(1.5707963268));
}

TEST_CASE("a recording may last eleven days, not longer", "[victoria_park]") {
  CHECK(victoria_park::parse_gnss("999999.0 0.0 0.0\n", "GPS.txt").front().utime ==
        999'999'000'000);
  for (const std::string time : {"1000001.0", "-0.001"}) {
    const std::string error =
        error_of([&] { victoria_park::parse_gnss(time + " 0.0 0.0\n", "GPS.txt"); });
    CHECK(contains(error, "GPS.txt"));
    CHECK(contains(error, "no time of this recording"));
  }
}

TEST_CASE("errors name the file, the line and the token", "[victoria_park]") {
  const auto laser = [](const std::string& text) {
    return error_of([&] { victoria_park::parse_laser(text, "LASER.txt"); });
  };
  CHECK(contains(laser(scan_record("0.8", 5.0, 360)), "LASER.txt, line 1, token 361"));
  CHECK(contains(laser(scan_record("0.8", 5.0, 360)), "a range [m]"));
  CHECK(contains(laser(scan_record("0.8", 5.0, 362) + scan_record("1.0", 5.0)), "token"));
  CHECK(contains(laser(scan_record("0.8", 120.0)), "token 2"));
  CHECK(contains(laser(""), "no record"));

  const auto wheels = [](const std::string& text) {
    return error_of([&] { victoria_park::parse_wheels(text, "DRS.txt"); });
  };
  CHECK(wheels("0.1 1.0 0.1\n0.2 1.0 0.1\n").empty());
  CHECK(contains(wheels("0.1 1.0 0.1\n0.2 x 0.1\n"), "DRS.txt, line 2, token 5: 'x'"));
  CHECK(contains(wheels("0.1 1.0 0.1\n0.1 1.0 0.1\n"), "does not come after"));
  CHECK(contains(wheels("0.1 nan 0.1\n"), "not a finite number"));
  CHECK(contains(wheels("0.1 1.0 3.0\n"), "steering"));
  CHECK(contains(wheels("0.1 1.0"), "the file ends where the steering angle [rad] is expected"));
}

TEST_CASE("GPS.txt gives the latitude first", "[victoria_park]") {
  const auto fixes = victoria_park::parse_gnss("0.000 0.0 0.0\n1.001 0.05 -0.08\n", "GPS.txt");
  REQUIRE(fixes.size() == 2);
  CHECK(fixes[1].east_north_m.x() == Approx(-0.08));
  CHECK(fixes[1].east_north_m.y() == Approx(0.05));
}

TEST_CASE("a folder of the files is read, whatever the case of their names", "[victoria_park]") {
  const TemporaryFolder folder;
  write_file(folder.path / "laser.TXT", scan_record("0.852", 5.0));
  write_file(folder.path / "DRS.txt", "0.1 1.0 0.1\n");
  CHECK(contains(error_of([&] { read_victoria_park(folder.path); }), "GPS.txt: no such file"));
  write_file(folder.path / "GPS.txt", "0.0 0.0 0.0\n");
  const auto recording = read_victoria_park(folder.path);
  CHECK(recording.scans.size() == 1);
  CHECK(recording.wheels.size() == 1);
  CHECK(recording.gnss.size() == 1);
}

TEST_CASE("what is no recording is named", "[victoria_park]") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "broken.zip";
  CHECK(contains(error_of([&] { read_victoria_park(file); }), "does not exist"));
  write_file(file, "PK this is no archive");
  CHECK(contains(error_of([&] { read_victoria_park(file); }), "broken.zip: neither a folder"));
}

TEST_CASE("the set is read as it is downloaded", "[victoria_park][recorded]") {
  const fs::path archive = test::recording("victoria_park_raw/victoria_park_ascii.zip");
  const auto recording = read_victoria_park(archive);
  CHECK(recording.scans.size() == 7230);
  CHECK(recording.wheels.size() == 61'763);
  CHECK(recording.gnss.size() == 948);
  CHECK(recording.scans.front().utime == 852'000);
  CHECK(recording.scans.back().utime == 1'545'182'000);
  std::size_t near = 0;

  for (const auto& scan : recording.scans) {
    for (const float range : scan.ranges_m) near += range < 75.0F ? 1 : 0;
  }

  CHECK(static_cast<double>(near) / (7230.0 * 361.0) == Approx(0.17).margin(0.01));
  CHECK(contains(error_of([&] { RecordingFolder(archive).read("NONE.txt"); }),
                 "victoria_park_ascii.zip:NONE.txt"));
}
