// KITTI drives, packet captures and tables.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include <unistd.h>

#include "common/io/data_error.hpp"
#include "common/io/date_time.hpp"
#include "common/io/kitti_raw.hpp"
#include "common/io/packet_capture.hpp"
#include "common/io/sensor_tables.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::io;
namespace fs = std::filesystem;

namespace {

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("understory_io_" + std::to_string(::getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path write(const std::string& name, const std::string& content) const {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;
    return path_ / name;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

TEST_CASE("a KITTI drive is read with rings and times", "[kitti][recorded]") {
  const fs::path folder = test::recording("kitti_raw_drive0002");
  const KittiRaw drive(folder);
  REQUIRE(drive.sweeps() == 10);
  REQUIRE(drive.oxts().size() == 10);
  REQUIRE(drive.imu_T_velo());
  CHECK(drive.imu_T_velo()->translation().z() == Approx(0.80).margin(0.02));
  CHECK(drive.oxts()[0].forward_velocity_mps == Approx(8.62).margin(0.01));

  // The records' own track agrees with their speed.
  const LocalPlane plane(drive.oxts()[0].latitude_deg, drive.oxts()[0].longitude_deg);
  const auto& last = drive.oxts().back();
  CHECK(plane.east_north_m(last.latitude_deg, last.longitude_deg).norm() ==
        Approx(8.19).margin(0.05));

  for (std::size_t i = 0; i < drive.sweeps(); ++i) {
    const model::PointSweep sweep = drive.read_sweep(i);
    CHECK(sweep.points.size() > 115'000);
    std::map<int, std::pair<double, int>> elevation;

    for (const model::SweepPoint& p : sweep.points) {
      auto& [sum, count] = elevation[p.ring];
      sum += std::atan2(p.z_m, std::hypot(p.x_m, p.y_m));
      ++count;
    }

    CHECK(elevation.size() == 64);
    double below = -1.0;
    for (const auto& [ring, sums] : elevation) {
      const double mean = sums.first / sums.second;
      CHECK(mean > below - 0.003);
      below = mean;
    }

    CHECK(sweep.points.front().time_s >= 0.0F);
    CHECK(sweep.points.back().time_s == Approx(0.1032).margin(0.001));
    if (i > 0) CHECK(sweep.utime > drive.read_sweep(i - 1).utime);
  }
}

TEST_CASE("the reduced KITTI drive is read with its poses", "[kitti][recorded]") {
  const fs::path folder = test::recording("kitti_raw_drive0005_16ring");
  const ReducedKitti drive(folder, "icp");
  REQUIRE(drive.sweeps() == 154);
  CHECK(drive.poses().size() == 154);
  std::size_t points = 0;

  for (std::size_t i = 0; i < drive.sweeps(); ++i) {
    const model::PointSweep sweep = drive.read_sweep(i);
    points += sweep.points.size();
    for (const model::SweepPoint& p : sweep.points) REQUIRE(p.ring < 16);
  }

  CHECK(points == 4'677'499);
  CHECK_THROWS_AS(ReducedKitti(folder, "gps"), DataError);
}

TEST_CASE("metres of fixes go on across the date line", "[oxts]") {
  const LocalPlane plane(-17.0, 179.9999);
  const Eigen::Vector2d before = plane.east_north_m(-17.0, 179.9998);
  const Eigen::Vector2d behind = plane.east_north_m(-17.0, -179.9999);
  CHECK(before.x() == Approx(-10.65).margin(0.05));
  CHECK(behind.x() == Approx(21.3).margin(0.1));
}

TEST_CASE("dates are read as ISO 8601 writes them", "[date]") {
  constexpr model::Utime kTime = 1'317'042'164'335'092;
  const auto parsed = [](std::string_view text) { return parse_date_times(text, "t"); };
  CHECK(parsed("2011-09-26 13:02:44.335092332\n") == std::vector{kTime});
  CHECK(parsed("\n2011-09-26T13:02:44.335092Z\r\n \n2011-09-26T15:02:44,335092+02:00\n"
               "2011-09-26 08:32:44.3350929-0430") == std::vector{kTime, kTime, kTime});
  CHECK(parsed("2011-09-26 13:02:44.5\n2011-09-26T15:02:45+02") ==
        std::vector<model::Utime>{1'317'042'164'500'000, 1'317'042'165'000'000});
  for (const char* bad :
       {"2011-13-26 13:02:44.335092332", "x", "2011-09-26", "2011-09-26 25:02:44.335092332",
        "2011-09-26 13:02:44.", "2011-09-26 13:02:44 CET", "2011-09-26 13:02:44+99:00",
        "2011-09-26_13:02:44", "2011-09-26 13:-2:44"})
    CHECK_THROWS_AS(parsed(bad), DataError);
  CHECK_THROWS_WITH(parsed("2011-09-26 13:02:44\n12.5\n"), "t, line 2: '12.5' is no time stamp");
  CHECK(begins_with_date(" \n2011-09-26 13"));
  for (const char* number : {"", "12.5", "-1", "1317042164.335", "2011"})
    CHECK_FALSE(begins_with_date(number));
}

TEST_CASE("KITTI's texts are checked", "[kitti]") {
  CHECK_THROWS_AS(kitti::parse_points("123", 0.1, "p"), DataError);
  CHECK(kitti::parse_points("", 0.1, "p").points.empty());
  std::string shuffled(16 * 300, '\0');
  for (std::size_t i = 0; i < 300; ++i) {
    const float place[] = {std::cos(2.4F * static_cast<float>(i * i)),
                           std::sin(2.4F * static_cast<float>(i * i)), 0.0F};
    std::memcpy(shuffled.data() + 16 * i, place, sizeof place);
  }
  CHECK_THROWS_WITH(kitti::parse_points(shuffled, 0.1, "p"),
                    "p: its points are not ring after ring");
  CHECK_THROWS_AS(parse_oxts("49.0 8.4 116", "o"), DataError);
  CHECK_THROWS_AS(kitti::parse_transform("a\nR: 1 0 0 0 1 0 0 0 2\nT: 0 0 0\n", "c"), DataError);
  CHECK_THROWS_AS(KittiRaw("/nowhere"), DataError);
}

TEST_CASE("tables of sensors are read by the names of their columns", "[csv]") {
  const auto imu = parse_imu_table("t_s,ax,ay,az,gx,gy,gz\n1.5,0,0,9.8,0.1,0.2,0.3\n", "imu.csv");
  REQUIRE(imu.size() == 1);
  CHECK(imu[0].utime == 1'500'000);
  CHECK(imu[0].angular_rate_rad_s == Eigen::Vector3d(0.1, 0.2, 0.3));
  const auto fixes = parse_gnss_table(
      "t_ns;latitude_deg;longitude_deg;sigma_m\n1000;49.0;8.0;0.5\n2000;49.001;8.0;0.5\n", "g.csv");
  REQUIRE(fixes.size() == 2);
  CHECK(fixes[1].east_north_m.y() == Approx(111.2).margin(0.2));

  CHECK(parse_wheel_table("t_us speed_mps\n5 2.5\n", "w.csv")[0].speed_mps == 2.5);
  CHECK_THROWS_AS(parse_imu_table("t_s,ax\n1,2\n", "imu.csv"), DataError);
  CHECK_THROWS_AS(parse_wheel_table("t_s,speed_mps\n2,1\n1,1\n", "w.csv"), DataError);
  CHECK_THROWS_AS(parse_wheel_table("t_s,speed_mps\n2,nan\n", "w.csv"), DataError);
  CHECK_THROWS_AS(parse_wheel_table("", "w.csv"), DataError);
  CHECK_THROWS_WITH(parse_wheel_table("t_s,speed_mps\n1,2\n2,1e300\n", "w.csv"),
                    "w.csv, line 3, token 4: speed_mps 1e+300 is no reading of a sensor");
}

TEST_CASE("captures that are cut or damaged end, and give whole packets", "[pcap][recorded]") {
  const fs::path file = test::recording("lidar_packets/velodyne_vlp16_gps.pcap");
  std::string bytes(fs::file_size(file), '\0');
  std::ifstream(file, std::ios::binary)
      .read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const Folder folder;
  std::mt19937_64 random(3);

  const auto read = [&](const std::string& content) -> std::size_t {
    const fs::path copy = folder.write("copy.pcap", content);
    std::size_t count = 0;
    try {
      PacketCapture capture(copy);
      while (const auto packet = capture.next()) {
        CHECK(packet->payload.size() <= 65535);
        ++count;
      }
    } catch (const DataError&) {
      return 0;
    }

    return count;
  };

  CHECK(read(bytes) == 350);
  CHECK(read("") == 0);
  for (int i = 0; i < 40; ++i) CHECK(read(bytes.substr(0, random() % 60'000)) < 60);

  for (int i = 0; i < 40; ++i) {
    std::string damaged = bytes.substr(0, 40'000);
    for (int k = 0; k < 10; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
    read(damaged);
  }
}
