// A folder of PCD files through the command.
#include <fstream>

#include "common/model/point_sweep.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Fixture {
  TemporaryDirectory directory;

  void write(const std::string& name, const std::string& viewpoint, int points) const {
    std::filesystem::create_directories(directory / "clouds");
    std::ofstream file(directory / ("clouds/" + name));
    file << "VERSION 0.7\nFIELDS x y z ring time\nSIZE 4 4 4 2 4\nTYPE F F F U F\nCOUNT 1 1 1 1 1\n"
         << "WIDTH " << points << "\nHEIGHT 1\nVIEWPOINT " << viewpoint << "\nPOINTS " << points
         << "\nDATA ascii\n";
    for (int i = 0; i < points; ++i)
      file << 10 + i << " 2 " << i % 4 << ' ' << i % 4 << ' ' << 0.001 * i << '\n';
  }
  Outcome import(const std::string& options) const {
    return understory_command(directory, "import clouds " + (directory / "clouds").string() +
                                             " --out " + (directory / "out.lcm").string() +
                                             options);
  }
  std::vector<model::PointSweep> sweeps() const {
    std::vector<model::PointSweep> found;
    io::LcmLogReader reader(directory / "out.lcm");
    for (const auto& event : read_log(reader))
      if (event.channel != "CONFIG")
        found.push_back(wire::decode_message<model::PointSweep>(event.data).value());
    return found;
  }
};

constexpr const char* kIdentity = "0 0 0 1 0 0 0";
constexpr const char* kTurned = "5 0 0 0.70710678 0 0 0.70710678";

}  // namespace

TEST_CASE_METHOD(Fixture, "files without points are counted, not imported", "[import][pcd]") {
  write("12.0.pcd", kIdentity, 40);
  write("12.1.pcd", kIdentity, 0);
  write("12.25.pcd", kIdentity, 40);
  const Outcome outcome = import("");
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("times: time (float32") && Contains("rings: ring, 4 counted") &&
                              Contains("2 sweeps"));
  CHECK_THAT(outcome.error, Contains("1 of 3 files have no points"));
  const auto all = sweeps();
  REQUIRE(all.size() == 2);
  CHECK(all[0].utime == 12'000'000);
  CHECK(all[1].utime == 12'250'000);
  CHECK(all[1].points.size() == 40);
}

TEST_CASE_METHOD(Fixture, "a viewpoint is applied or left as the user says", "[import][pcd]") {
  write("12.0.pcd", kTurned, 40);
  const Outcome asked = import("");
  CHECK(asked.status == 1);
  CHECK_THAT(asked.error, Contains("12.0.pcd: VIEWPOINT is not the identity: --points-in sensor"));
  CHECK_FALSE(std::filesystem::exists(directory / "out.lcm"));

  REQUIRE(import(" --points-in sensor").status == 0);
  CHECK((sweeps()[0].points[0].position() - Eigen::Vector3f(10, 2, 0)).norm() < 1e-3F);
  std::filesystem::remove(directory / "out.lcm");
  // The sensor is at x = 5 m and looks along y: a point at (10, 2) is 2 m ahead, 5 m to the right.
  REQUIRE(import(" --points-in world").status == 0);
  CHECK((sweeps()[0].points[0].position() - Eigen::Vector3f(2, -5, 0)).norm() < 1e-2F);
}

TEST_CASE_METHOD(Fixture, "names that only count want a rate", "[import][pcd]") {
  for (const char* name : {"000.pcd", "001.pcd", "002.pcd"}) write(name, kIdentity, 40);
  const Outcome asked = import("");
  CHECK(asked.status == 1);
  CHECK_THAT(asked.error, Contains("--rate HZ"));
  REQUIRE(import(" --rate 10").status == 0);
  CHECK(sweeps()[2].utime == 200'000);
}

TEST_CASE_METHOD(Fixture, "what is no log is not overwritten, clocks must have a time in common",
                 "[import][pcd]") {
  write("12.0.pcd", kIdentity, 40);
  std::ofstream(directory / "out.lcm") << "x_m,y_m\n1,2\n";
  const Outcome kept = import("");
  CHECK(kept.status == 1);
  CHECK_THAT(kept.error, Contains("out.lcm: is there already and is no LCM log"));
  CHECK(read_text(directory / "out.lcm") == "x_m,y_m\n1,2\n");
  std::filesystem::remove(directory / "out.lcm");

  std::ofstream(directory / "imu.csv") << "t_s,gx,gy,gz,ax,ay,az\n1700000000,0,0,0,0,0,9.81\n";
  const Outcome apart = import(" --imu " + (directory / "imu.csv").string());
  CHECK(apart.status == 1);
  CHECK_THAT(apart.error, Contains("their clocks have no time in common"));
  CHECK_FALSE(std::filesystem::exists(directory / "out.lcm"));
}
