// Clouds of any layout give the same points.
#include <cmath>
#include <random>

#include "common/bag/cloud_decoder.hpp"
#include "common/io/data_error.hpp"
#include "tests/bag/cloud_writer.hpp"
#include "tests/catch.hpp"

namespace understory::test {
namespace {

void check_points(const model::PointSweep& sweep, std::vector<Truth> wanted, double time_error_s,
                  bool has_intensity = true) {
  std::ranges::stable_sort(wanted, [](const Truth& a, const Truth& b) {
    return std::pair(a.time_s, a.ring) < std::pair(b.time_s, b.ring);
  });
  REQUIRE(sweep.points.size() == wanted.size());
  const double begin_s = 1e-6 * static_cast<double>(sweep.utime - kStamp / 1000);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    CAPTURE(i);
    const model::SweepPoint& point = sweep.points[i];
    REQUIRE(point.position() == wanted[i].position_m);
    REQUIRE(point.ring == wanted[i].ring);
    REQUIRE(point.time_s >= 0.0F);
    REQUIRE(std::abs(begin_s + point.time_s - wanted[i].time_s) <= time_error_s);
    if (has_intensity) REQUIRE(point.intensity == wanted[i].intensity);
  }
}

FieldForm ring_field(const std::string& name = "ring", std::uint8_t type = 4) {
  return {name, type, [](const Truth& p) { return p.ring; }};
}
FieldForm intensity_field(const std::string& name = "intensity", std::uint8_t type = 7) {
  return {name, type, [](const Truth& p) { return p.intensity; }};
}
FieldForm time_field(const std::string& name, std::uint8_t type, double unit_s,
                     double offset_s = 0.0) {
  return {name, type, [=](const Truth& p) {
            const double value = (p.time_s + offset_s) / unit_s;
            return type >= 7 ? value : std::round(value);
          }};
}

TEST_CASE("bag clouds: the layouts of drivers give the same points", "[clouds]") {
  struct Driver {
    std::string name;
    std::vector<FieldForm> more;
    double time_error_s;
    std::string said;
  };
  const double stamp_s = 1e-9 * static_cast<double>(kStamp);
  const std::vector<Driver> drivers{
      {"Velodyne",
       {time_field("time", 7, 1.0), ring_field(), intensity_field()},
       1e-6,
       "from the stamp"},
      {"Ouster",
       {time_field("t", 6, 1e-9), ring_field("ring", 2), intensity_field("reflectivity", 4)},
       1e-6,
       "unit 1e-09 s, from the stamp"},
      {"Hesai",
       {time_field("timestamp", 8, 1.0, stamp_s), ring_field(), intensity_field("intensity", 2)},
       2e-6,
       "of the stamp's clock"},
      {"Livox 2",
       {time_field("timestamp", 8, 1e-9, stamp_s), ring_field("line", 2), intensity_field()},
       2e-6,
       "unit 1e-09 s, of the stamp's clock"},
      {"nanoseconds as integers",
       {time_field("time_stamp", 6, 1e-9), ring_field("channel"), intensity_field("intensity", 2)},
       1e-6,
       "unit 1e-09 s, from the stamp"},
      {"microseconds as integers",
       {time_field("time_offset", 6, 1e-6), ring_field(), intensity_field()},
       1.1e-6,
       "unit 1e-06 s, from the stamp"},
      {"microseconds as floats",
       {time_field("time", 7, 1e-6), ring_field("ring", 5), intensity_field("i")},
       1.1e-6,
       "unit 1e-06 s, from the stamp"},
      {"milliseconds as floats",
       {time_field("t", 7, 1e-3), ring_field("ring", 6), intensity_field()},
       1.1e-6,
       "unit 0.001 s, from the stamp"}};
  Random random(1);
  for (const Driver& driver : drivers) {
    for (int round = 0; round < 5; ++round) {
      CAPTURE(driver.name, round);
      const auto points = revolution(random);
      auto fields = positions(round % 2 == 0 ? 7 : 8);
      fields.insert(fields.end(), driver.more.begin(), driver.more.end());
      const auto made = make_cloud(random, points, fields);
      bag::CloudDecoder decoder;
      const model::PointSweep sweep = decoder.decode(made->cloud);
      CHECK(sweep.has_times);
      CHECK(sweep.rings == 16);
      CHECK_THAT(decoder.description(), Catch::Matchers::Contains(driver.said));
      check_points(sweep, points, driver.time_error_s);
    }
  }
}

TEST_CASE("bag clouds: stamps at the end of the sweep", "[clouds]") {
  Random random(2);
  auto points = revolution(random);
  for (Truth& point : points) point.time_s -= 0.1;
  auto fields = positions();
  for (const auto& field : {time_field("time", 7, 1.0), ring_field(), intensity_field()})
    fields.push_back(field);
  const auto made = make_cloud(random, points, fields);
  bag::CloudDecoder decoder;
  const model::PointSweep sweep = decoder.decode(made->cloud);
  CHECK(std::abs(sweep.utime - (kStamp / 1000 - 100'000)) <= 1);
  check_points(sweep, points, 1e-6);
}

TEST_CASE("bag clouds: a clock of its own begins at the stamp", "[clouds]") {
  Random random(3);
  const auto points = revolution(random);
  for (const double unit : {1.0, 1e-9}) {
    auto fields = positions();
    // TAI is 37 s ahead of UTC; a sensor without a clock counts from when it was switched on.
    for (const double offset_s : {1e-9 * static_cast<double>(kStamp) + 37.0, 812.5}) {
      CAPTURE(unit, offset_s);
      auto own = fields;
      for (const auto& field :
           {time_field("timestamp", 8, unit, offset_s), ring_field(), intensity_field()})
        own.push_back(field);
      const auto made = make_cloud(random, points, own);
      bag::CloudDecoder decoder;
      const model::PointSweep sweep = decoder.decode(made->cloud);
      CHECK_THAT(decoder.description(), Catch::Matchers::Contains("a clock of its own"));
      CHECK(sweep.utime == kStamp / 1000);
      check_points(sweep, points, 2e-6);
    }
  }
}

TEST_CASE("bag clouds: organised clouds, row by row and column by column, with holes", "[clouds]") {
  Random random(4);
  for (const bool is_by_row : {true, false}) {
    for (const bool is_downwards : {true, false}) {
      CAPTURE(is_by_row, is_downwards);
      const auto by_firing = revolution(random);
      std::vector<Truth> ordered;
      for (std::size_t i = 0; i < by_firing.size(); ++i) {
        const std::size_t beam = is_by_row ? i / 60 : i % 16;
        const std::size_t firing = is_by_row ? i % 60 : i / 16;
        ordered.push_back(by_firing[16 * firing + (is_downwards ? 15 - beam : beam)]);
      }
      std::vector<Truth> seen;
      for (Truth& point : ordered) {
        const auto fate = random() % 5;
        if (fate == 0) point.position_m.setZero();
        if (fate == 1) point.position_m.y() = std::nanf("");
        if (fate > 1) seen.push_back(point);
      }

      auto fields = positions();
      fields.push_back(time_field("t", 6, 1e-9));
      const auto made = make_cloud(random, ordered, fields, is_by_row ? 16 : 60);
      bag::CloudDecoder decoder;
      const model::PointSweep sweep = decoder.decode(made->cloud);
      CHECK(sweep.rings == 16);
      CHECK_THAT(decoder.description(), Catch::Matchers::Contains(is_by_row ? "rows" : "columns"));
      check_points(sweep, seen, 1e-6, false);
    }
  }
}

TEST_CASE("bag clouds: rings in any order become those from below", "[clouds]") {
  Random random(5);
  const auto points = revolution(random);
  std::vector<std::uint32_t> number(16);
  for (std::uint32_t i = 0; i < 16; ++i) number[i] = (5 * i + 3) % 16;
  auto fields = positions();
  fields.push_back(time_field("t", 6, 1e-9));
  fields.push_back({"ring", 4, [&](const Truth& p) { return number[p.ring]; }});
  const auto made = make_cloud(random, points, fields);
  bag::CloudDecoder decoder;
  check_points(decoder.decode(made->cloud), points, 1e-6, false);
  CHECK_THAT(decoder.description(), Catch::Matchers::Contains("sorted"));
}

TEST_CASE("bag clouds: fields that hold no times are said to", "[clouds]") {
  Random random(6);
  const auto points = revolution(random);
  const double stamp_s = 1e-9 * static_cast<double>(kStamp);
  for (const auto& [field, said] :
       {std::pair{FieldForm{"time", 7, [](const Truth&) { return 0.0; }}, "always the same"},
        std::pair{time_field("timestamp", 7, 1.0, stamp_s), "none"}}) {
    auto fields = positions();
    fields.push_back(field);
    fields.push_back(ring_field());
    const auto made = make_cloud(random, points, fields);
    bag::CloudDecoder decoder;
    const model::PointSweep sweep = decoder.decode(made->cloud);
    CHECK_FALSE(sweep.has_times);
    CHECK(sweep.utime == kStamp / 1000);
    CHECK_THAT(decoder.description(), Catch::Matchers::Contains(said));
  }

  auto fields = positions();
  const auto made = make_cloud(random, points, fields);
  bag::CloudDecoder decoder;
  CHECK_FALSE(decoder.decode(made->cloud).has_times);
  CHECK(decoder.decode(made->cloud).rings == 16);
  CHECK_THAT(decoder.description(), Catch::Matchers::Contains("found from elevations, 16"));

  std::uniform_real_distribution<float> anywhere(-20.0F, 20.0F);
  auto scattered = points;
  for (Truth& point : scattered)
    point.position_m = {anywhere(random), anywhere(random), anywhere(random)};
  const auto ringless = make_cloud(random, scattered, fields);
  bag::CloudDecoder other;
  CHECK(other.decode(ringless->cloud).rings == 0);
  CHECK_THAT(other.description(), Catch::Matchers::Contains("rings: none"));
}

TEST_CASE(
    "bag clouds: the unit that is stated holds; shares are intensities; far points are left out",
    "[clouds]") {
  Random random(7);
  auto points = revolution(random);
  auto fields = positions();
  fields.push_back(time_field("t", 6, 1e-6));
  fields.push_back(ring_field());
  fields.push_back({"intensity", 7, [](const Truth& p) { return p.intensity / 255.0; }});
  const auto made = make_cloud(random, points, fields);
  bag::CloudDecoder decoder({.time_unit_s = 1e-6, .max_range_m = 20.0});
  std::erase_if(points, [](const Truth& p) { return p.position_m.norm() > 20.2F; });
  const model::PointSweep sweep = decoder.decode(made->cloud);
  CHECK(sweep.max_range_m == 20.0);
  check_points(sweep, points, 1.1e-6);
}

TEST_CASE("bag clouds: what does not fit is refused", "[clouds]") {
  Random random(8);
  const auto points = revolution(random);
  auto fields = positions();
  fields.push_back(ring_field());
  const auto refused = [&](const std::function<void(bag::PointCloud&)>& spoil,
                           const std::string& what) {
    const auto made = make_cloud(random, points, fields);
    spoil(made->cloud);
    bag::CloudDecoder decoder;
    CHECK_THROWS_WITH(decoder.decode(made->cloud), Catch::Matchers::Contains(what));
  };
  refused([](auto& c) { c.width += 1; }, "bytes of data");
  refused(
      [](auto& c) {
        c.height = 0xffffffff;
        c.width = 0xffffffff;
      },
      "points");
  refused([](auto& c) { c.point_step = 0; }, "");
  refused(
      [](auto& c) {
        c.point_step = 0xffffffff;
        c.row_step = 0xffffffff;
      },
      "bytes of data");
  refused(
      [](auto& c) {
        for (auto& f : c.fields) f.offset = 0xffffffff;
      },
      "does not lie");
  refused(
      [](auto& c) {
        for (auto& f : c.fields) f.type = 11;
      },
      "type 11");
  refused([](auto& c) { c.fields.clear(); }, "without the field x");

  fields.push_back({"timestamp", 8, [](const Truth& p) { return p.ring * 1e300; }});
  refused([](auto&) {}, "");
}

TEST_CASE("bag clouds: Livox's own message", "[clouds]") {
  bag::LivoxCloud cloud{{kStamp, "livox"}, 1, {}};
  for (std::uint32_t i = 1; i <= 100; ++i)
    cloud.points.push_back({i * 1'000'000,
                            {static_cast<float>(i), 0.0F, static_cast<float>(i % 4)},
                            static_cast<std::uint8_t>(i),
                            static_cast<std::uint8_t>(i % 4)});
  cloud.points.push_back({0, {0.0F, 0.0F, 0.0F}, 0, 0});
  bag::CloudDecoder decoder;
  const model::PointSweep sweep = decoder.decode(cloud);
  REQUIRE(sweep.points.size() == 100);
  CHECK(sweep.utime == kStamp / 1000);
  CHECK(sweep.rings == 4);
  CHECK(sweep.points[9].time_s == Approx(0.01));
  CHECK(sweep.points[9].intensity == 10);
}

}  // namespace
}  // namespace understory::test
