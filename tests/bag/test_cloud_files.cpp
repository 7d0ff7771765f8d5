// PCD, PLY and KITTI's files: the layouts that drivers, PCL and CloudCompare write give the same
// points.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "common/bag/cloud_decoder.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/io/data_error.hpp"
#include "tests/bag/cloud_writer.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// A column of the file: SIZE, TYPE, COUNT and its first value; more values are noise.
struct PcdColumn {
  std::string name;
  char type = 'F';
  std::uint32_t bytes = 4;
  std::uint32_t count = 1;
  std::function<double(const Truth&)> value = [](const Truth&) { return 0.0; };
};

struct PcdForm {
  std::string kind = "binary";  ///< Of DATA.
  std::vector<PcdColumn> columns;
  std::uint32_t rows = 1;
  std::string line_end = "\n";
  std::string viewpoint = "0 0 0 1 0 0 0";
};

std::string raw(const PcdColumn& column, double value) {
  std::string bytes(column.bytes, '\0');
  auto* at = reinterpret_cast<std::uint8_t*>(bytes.data());
  if (column.type == 'F')
    put(at, column.bytes == 4 ? 7 : 8, value, false);
  else if (column.bytes == 8)
    put_number<std::int64_t>(at, value, false);
  else
    put(at,
        static_cast<std::uint8_t>((column.bytes == 4   ? 5
                                   : column.bytes == 2 ? 3
                                                       : 1) +
                                  (column.type == 'U' ? 1 : 0)),
        value, false);
  return bytes;
}

/// LZF that packs nothing: literals of 32 bytes at most.
std::string literals(const std::string& body) {
  std::string packed;
  for (std::size_t at = 0; at < body.size(); at += 32) {
    const std::string part = body.substr(at, 32);
    packed += static_cast<char>(part.size() - 1);
    packed += part;
  }
  std::string sizes;
  for (const std::size_t size : {packed.size(), body.size()}) {
    const auto number = static_cast<std::uint32_t>(size);
    sizes.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  return sizes + packed;
}

std::string pcd(const PcdForm& form, const std::vector<Truth>& points) {
  std::map<std::string, std::vector<std::string>> header;
  for (const PcdColumn& column : form.columns) {
    header["FIELDS"].push_back(column.name);
    header["SIZE"].push_back(std::to_string(column.bytes));
    header["TYPE"].emplace_back(1, column.type);
    header["COUNT"].push_back(std::to_string(column.count));
  }
  std::string text = "# .PCD v0.7" + form.line_end + "VERSION 0.7" + form.line_end;
  for (const char* key : {"FIELDS", "SIZE", "TYPE", "COUNT"})
    text += fmt::format("{} {}{}", key, fmt::join(header[key], " "), form.line_end);
  text += fmt::format("WIDTH {1}{0}HEIGHT {2}{0}VIEWPOINT {3}{0}POINTS {4}{0}DATA {5}{0}",
                      form.line_end, points.size() / form.rows, form.rows, form.viewpoint,
                      points.size(), form.kind);

  std::string body;
  const auto put_point = [&](const Truth& point, const PcdColumn& column) {
    for (std::uint32_t c = 0; c < column.count; ++c) {
      const double value = c == 0 ? column.value(point) : 7.0;
      if (form.kind == "ascii")
        body += (column.type == 'F' ? fmt::format("{} ", value)
                                    : fmt::format("{} ", static_cast<std::int64_t>(value)));
      else
        body += raw(column, value);
    }
  };
  if (form.kind == "binary_compressed") {
    for (const PcdColumn& column : form.columns) {
      for (const Truth& point : points) put_point(point, column);
    }
    return text + literals(body);
  }
  for (const Truth& point : points) {
    for (const PcdColumn& column : form.columns) put_point(point, column);
    if (form.kind == "ascii") body += form.line_end;
  }
  return text + body;
}

std::vector<PcdColumn> columns_of(Random& random, char type, std::uint32_t bytes,
                                  const std::string& time, double unit_s, double begin) {
  const std::uint32_t size = random() % 2 == 0 ? 4 : 8;
  std::vector<PcdColumn> columns{
      {"x", 'F', size, 1, [](const Truth& p) { return p.position_m.x(); }},
      {"y", 'F', size, 1, [](const Truth& p) { return p.position_m.y(); }},
      {"z", 'F', size, 1, [](const Truth& p) { return p.position_m.z(); }},
      {"ring", 'U', random() % 2 == 0 ? 1U : 2U, 1,
       [](const Truth& p) { return static_cast<double>(p.ring); }},
      {"intensity", 'F', 4, 1, [](const Truth& p) { return static_cast<double>(p.intensity); }},
      {time, type, bytes, 1,
       [=](const Truth& p) {
         const double time = begin + p.time_s / unit_s;
         return type == 'F' ? time : std::round(time);
       }},
      {"_", 'U', 1, static_cast<std::uint32_t>(1 + random() % 12)},
      {"normal", 'F', 4, 3},
      {"_", 'U', 1, 4}};
  std::shuffle(columns.begin(), columns.end(), random);
  return columns;
}

/// A PLY file; `format` as in its header. Faces stand behind the vertices.
std::string ply(const std::string& format, const std::vector<PcdColumn>& columns,
                const std::vector<Truth>& points) {
  std::string text = "ply\nformat " + format + " 1.0\ncomment by nobody\n";
  text += fmt::format("element vertex {}\n", points.size());
  for (const PcdColumn& column : columns) {
    const std::string type = column.type == 'F'  ? (column.bytes == 4 ? "float" : "float64")
                             : column.bytes == 1 ? "uchar"
                             : column.bytes == 2 ? "uint16"
                                                 : "uint";
    text += fmt::format("property {} {}\n", type, column.name);
  }
  text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Truth& point : points) {
    for (const PcdColumn& column : columns) {
      if (format == "ascii") {
        text += fmt::format("{} ", column.value(point));
        continue;
      }
      std::string bytes = raw(column, column.value(point));
      if (format == "binary_big_endian") std::ranges::reverse(bytes);
      text += bytes;
    }
    if (format == "ascii") text += '\n';
  }
  return text + (format == "ascii" ? "3 0 1 2\n" : std::string(13, '\1'));
}

void check_same(const model::PointSweep& sweep, const std::vector<Truth>& points) {
  REQUIRE(sweep.points.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK((sweep.points[i].position() - points[i].position_m).norm() < 1e-5);
    CHECK(sweep.points[i].ring == points[i].ring);
    CHECK(sweep.points[i].intensity == points[i].intensity);
    CHECK(std::abs(static_cast<double>(sweep.points[i].time_s) - points[i].time_s) < 2e-6);
  }
}

model::PointSweep decoded(const std::string& text, bag::CloudDecoder& decoder) {
  bag::CloudFile file = bag::parse_pcd(text, "cloud.pcd");
  file.cloud.header.stamp_ns = kStamp;
  return decoder.decode(file.cloud);
}

bool parses(const std::string& text) {
  try {
    bag::CloudDecoder decoder;
    decoded(text, decoder);
    return true;
  } catch (const io::DataError&) {
    return false;
  }
}

}  // namespace

TEST_CASE("PCD files of all kinds, types and units hold the same points", "[pcd]") {
  Random random(1);
  struct Time {
    const char* name;
    char type;
    std::uint32_t bytes;
    double unit_s;
    double begin;  ///< In the unit.
  };
  const std::vector<Time> times{{"t", 'U', 4, 1e-9, 0.0},
                                {"time", 'F', 4, 1.0, 0.0},
                                {"timestamp", 'F', 8, 1.0, 1e-9 * kStamp},
                                {"timestamp", 'F', 8, 1e-9, 0.0},
                                {"time_offset", 'U', 4, 1e-6, 0.0},
                                {"offset_time", 'U', 4, 1e-9, 0.0},
                                {"timestamp", 'U', 8, 1e-6, 1e-3 * kStamp}};
  for (const Time& time : times) {
    for (const char* kind : {"ascii", "binary", "binary_compressed"}) {
      const std::vector<Truth> points = revolution(random);
      PcdForm form{kind,
                   columns_of(random, time.type, time.bytes, time.name, time.unit_s, time.begin)};
      if (random() % 2 == 0) form.line_end = "\r\n";
      CAPTURE(time.name, time.type, time.bytes, time.unit_s, kind, form.line_end == "\r\n");
      bag::CloudDecoder decoder;
      const model::PointSweep sweep = decoded(pcd(form, points), decoder);
      CHECK(sweep.has_times);
      CHECK(sweep.rings == 16);
      check_same(sweep, points);
    }
  }
}

TEST_CASE("PLY files of all kinds hold the same points, with CloudCompare's names", "[pcd]") {
  Random random(5);
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::vector<Truth> points = revolution(random);
    std::vector<PcdColumn> columns = columns_of(random, 'F', 8, "timestamp", 1.0, 1e-9 * kStamp);
    std::erase_if(columns,
                  [](const PcdColumn& column) { return column.count > 1 || column.name == "_"; });
    for (PcdColumn& column : columns) {
      if (column.name == "intensity") column.name = "scalar_Intensity";
    }
    const std::string text = ply(format, columns, points);
    CAPTURE(format);
    const auto sweep_of = [](const std::string& bytes) {
      bag::CloudFile file = bag::parse_ply(bytes, "cloud.ply");
      file.cloud.header.stamp_ns = kStamp;
      return bag::CloudDecoder().decode(file.cloud);
    };
    check_same(sweep_of(text), points);

    const auto is_read = [&](const std::string& bytes) {
      try {
        sweep_of(bytes);
        return true;
      } catch (const io::DataError&) {
        return false;
      }
    };
    for (std::size_t size = 0; size + 40 < text.size(); size += 997)
      CHECK_FALSE(is_read(text.substr(0, size)));
    for (int i = 0; i < 300; ++i) {
      std::string damaged = text;
      for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
      is_read(damaged);
    }
  }
  CHECK_THROWS_WITH(bag::parse_ply("ply\nformat ascii 1.0\nelement face 1\nend_header\n", "a.ply"),
                    Contains("a.ply: element face 1: vertices are wanted first"));
}

TEST_CASE("KITTI's files hold x, y, z and intensity; rings are found", "[pcd]") {
  Random random(6);
  const std::vector<Truth> points = revolution(random);
  std::string bytes;
  for (const Truth& point : points) {
    const std::array<float, 4> values{point.position_m.x(), point.position_m.y(),
                                      point.position_m.z(),
                                      static_cast<float>(point.intensity) / 255.0F};
    bytes.append(reinterpret_cast<const char*>(values.data()), sizeof values);
  }
  const bag::CloudFile file = bag::parse_cloud_file(bytes, "000000.bin");
  const model::PointSweep sweep = bag::CloudDecoder().decode(file.cloud);
  CHECK(sweep.points.size() == points.size());
  CHECK(sweep.rings == 16);
  CHECK_THROWS_WITH(bag::parse_cloud_file(bytes.substr(1), "000000.bin"),
                    Contains("000000.bin: ") && Contains("no whole points of 16"));
}

TEST_CASE("rows of an organised PCD file are rings, what is no number is no return", "[pcd]") {
  Random random(2);
  std::vector<Truth> points = revolution(random);
  std::ranges::stable_sort(points, {}, &Truth::ring);
  std::size_t returns = points.size();
  for (Truth& point : points) {
    if (random() % 3 != 0) continue;
    point.position_m.setConstant(std::nanf(""));
    --returns;
  }
  PcdForm form;
  form.rows = 16;
  form.columns = columns_of(random, 'F', 4, "time", 1.0, 0.0);
  std::erase_if(form.columns, [](const PcdColumn& column) { return column.name == "ring"; });
  for (const char* kind : {"ascii", "binary", "binary_compressed"}) {
    form.kind = kind;
    bag::CloudDecoder decoder;
    const model::PointSweep sweep = decoded(pcd(form, points), decoder);
    CHECK(sweep.points.size() == returns);
    CHECK(sweep.rings == 16);
  }
}

TEST_CASE("a viewpoint is read, and a file without points is no error", "[pcd]") {
  Random random(3);
  PcdForm form;
  form.columns = columns_of(random, 'F', 4, "time", 1.0, 0.0);
  form.viewpoint = "1 2 3 0.7071068 0 0 0.7071068";
  const bag::CloudFile file = bag::parse_pcd(pcd(form, {}), "cloud.pcd");
  CHECK(file.cloud.width * file.cloud.height == 0);
  CHECK((file.viewpoint * Eigen::Vector3d::UnitX() - Eigen::Vector3d(1, 3, 3)).norm() < 1e-6);
  form.viewpoint = "1 2 3 0 0 0 0";
  CHECK_THROWS_WITH(bag::parse_pcd(pcd(form, {}), "cloud.pcd"),
                    Contains("cloud.pcd: VIEWPOINT is no place and direction"));
}

TEST_CASE("a PCD file that is cut or damaged is refused or read, never worse", "[pcd]") {
  Random random(4);
  const std::vector<Truth> points = revolution(random, 20);
  for (const char* kind : {"ascii", "binary", "binary_compressed"}) {
    PcdForm form{kind, columns_of(random, 'F', 8, "timestamp", 1.0, 1e6)};
    const std::string good = pcd(form, points);
    REQUIRE(parses(good));
    for (std::size_t size = 0; size + 40 < good.size(); size += 97)
      CHECK_FALSE(parses(good.substr(0, size)));
    for (int i = 0; i < 1000; ++i) {
      std::string damaged = good;
      for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
      parses(damaged);
    }
  }
  PcdForm form{"binary", columns_of(random, 'F', 4, "time", 1.0, 0.0)};
  std::string wrong = pcd(form, points);
  const std::string count = fmt::format("POINTS {}", points.size());
  wrong.replace(wrong.find(count), count.size(), fmt::format("POINTS {}", points.size() / 2));
  CHECK_THROWS_WITH(bag::parse_pcd(wrong, "wrong.pcd"),
                    Contains("wrong.pcd: WIDTH") && Contains("is not POINTS"));
  CHECK_THROWS_WITH(bag::parse_pcd(pcd(form, points) + std::string(100, '\0'), "long.pcd"),
                    Contains("long.pcd: 100 bytes behind the last of"));
  CHECK_THROWS_WITH(bag::parse_cloud_file("", "a.pcd.bin"), Contains("five numbers a point"));

  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  for (const char* kind : {"ascii", "binary", "binary_compressed"}) {
    CHECK_FALSE(parses(fields + "POINTS 99999999999\nDATA " + kind + "\n"));
    CHECK_FALSE(parses(fields + "POINTS 19999999\nDATA " + kind + "\n"));
    CHECK_FALSE(parses(fields + "POINTS many\nDATA " + kind + "\n"));
  }
}

TEST_CASE("LZF of PCL is unpacked: literals and what they are repeated by", "[pcd]") {
  // x y z of one point each: 1 1 1, as three literals of four bytes, then eight bytes again.
  std::string text = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 1\n";
  text += "DATA binary_compressed\n";
  const std::string packed{'\x03', '\x00', '\x00', '\x80', '\x3f', '\xc0', '\x03'};
  for (const std::uint32_t size : {static_cast<std::uint32_t>(packed.size()), 12U})
    text.append(reinterpret_cast<const char*>(&size), sizeof size);
  bag::CloudDecoder decoder;
  const model::PointSweep sweep = decoded(text + packed, decoder);
  REQUIRE(sweep.points.size() == 1);
  CHECK(sweep.points[0].position() == Eigen::Vector3f::Ones());
}

TEST_CASE("a sequence of PCD files has its times from names, a table or a rate", "[pcd]") {
  const Scratch scratch("pcd-sequence");
  const auto write = [&](const std::string& name, const std::string& content = "") {
    const auto file = scratch.path() / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << content;
  };
  const auto utimes = [&](const char* folder, double rate_hz = 0.0) {
    std::vector<model::Utime> all;
    for (const auto& entry : bag::find_cloud_sequence(scratch.path() / folder, rate_hz))
      all.push_back(entry.utime);
    return all;
  };
  using Utimes = std::vector<model::Utime>;

  for (const char* name : {"1317042164.5.pcd", "1317042164.4.pcd"})
    write(std::string("seconds/") + name);
  CHECK(utimes("seconds") == Utimes{1'317'042'164'400'000, 1'317'042'164'500'000});
  for (const char* unit : {"000", "000000", "000000000"}) {
    const std::string folder = std::string("u") + unit;
    for (const char* name : {"1317042165", "1317042164"})
      write(folder + "/" + name + unit + ".pcd");
    CHECK(utimes(folder.c_str()) == Utimes{1'317'042'164'000'000, 1'317'042'165'000'000});
  }

  for (int i = 9; i <= 11; ++i) write("count/" + std::to_string(i) + ".pcd");
  CHECK_THROWS_WITH(utimes("count"), Contains("count 9 to 11 are no times") && Contains("--rate"));
  CHECK(utimes("count", 10.0) == Utimes{900'000, 1'000'000, 1'100'000});

  write("named/x.pcd");
  CHECK_THROWS_AS(utimes("named"), io::DataError);
  write("named/timestamps.txt", "12.25\n");
  CHECK(utimes("named") == Utimes{12'250'000});
  CHECK_THROWS_AS(utimes("none"), io::DataError);

  // Names that are no times want a rate, too; times that stand still are refused.
  write("words/scan_1.ply");
  write("words/scan_2.ply");
  CHECK_THROWS_WITH(utimes("words"), Contains("scan_1.ply: a name that is no time"));
  CHECK(utimes("words", 20.0) == Utimes{0, 50'000});
  write("words/timestamps.txt", "5\n5\n");
  CHECK_THROWS_WITH(utimes("words"), Contains("scan_2.ply: its time, 5.000000 s, is not behind"));

  // KITTI has the times in the folder above.
  for (const char* name : {"000000.bin", "000001.bin"}) write(std::string("00/velodyne/") + name);
  write("00/times.txt", "0.0\n0.1036\n");
  CHECK(utimes("00/velodyne") == Utimes{0, 103'600});
  // Raw drives have dates.
  for (const char* name : {"0000000000.bin", "0000000001.bin"})
    write(std::string("drive/velodyne_points/data/") + name);
  write("drive/velodyne_points/timestamps.txt",
        "2011-09-26 13:02:25.594360375\n2011-09-26 13:02:25.698000000\n");
  CHECK(utimes("drive/velodyne_points/data") ==
        Utimes{1'317'042'145'594'360, 1'317'042'145'698'000});
  write("drive/velodyne_points/data/0000000003.bin");
  write("drive/velodyne_points/timestamps.txt",
        "2011-09-26 13:02:25\n2011-09-26 13:02:26\n2011-09-26 13:02:27\n2011-09-26 13:02:28\n");
  CHECK(utimes("drive/velodyne_points/data") ==
        Utimes{1'317'042'145'000'000, 1'317'042'146'000'000, 1'317'042'148'000'000});
  write("drive/velodyne_points/data/0000000004.bin");
  write("drive/velodyne_points/data/0000000005.bin");
  CHECK_THROWS_WITH(utimes("drive/velodyne_points/data"), Contains("5 files for 4 time stamps"));
  write("dates/a.pcd");
  write("dates/timestamps.txt", "2011-09-26 13h02\n");
  CHECK_THROWS_WITH(utimes("dates"),
                    Contains("dates/timestamps.txt, line 1: '2011-09-26 13h02' is no time stamp"));
  write("00/velodyne/000002.ply");
  CHECK_THROWS_WITH(utimes("00/velodyne"), Contains(".bin and .ply files: one kind is wanted"));
}
