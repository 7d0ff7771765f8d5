// Bytes of geometries.
#include "common/map_file/geometry_blob.hpp"
#include "tests/map_file/map_fixture.hpp"

using namespace understory;
using namespace understory::test;
using map_file::geometry_of;
using map_file::GeometryKind;

TEST_CASE("geometries come back from their bytes, cut ones do not", "[map_file]") {
  std::mt19937_64 random(21);
  for (const GeometryKind kind :
       {GeometryKind::kPoint, GeometryKind::kLine, GeometryKind::kPolygon}) {
    for (int run = 0; run < 50; ++run) {
      map_file::Geometry geometry{kind, {}};
      const std::size_t count = kind == GeometryKind::kPoint ? 1 : 3 + random() % 5;
      for (std::size_t i = 0; i < count; ++i) geometry.points_m.push_back(random_place(random));
      const auto bytes = map_file::geometry_blob(geometry);
      const auto back = geometry_of(bytes);
      REQUIRE(back);
      CHECK(back->kind == kind);
      CHECK(back->points_m == geometry.points_m);
      for (std::size_t size = 0; size < bytes.size(); ++size)
        CHECK_FALSE(geometry_of({bytes.data(), size}));
      auto longer = bytes;
      longer.push_back(0);
      CHECK_FALSE(geometry_of(longer));
    }
  }
}

TEST_CASE("both orders of bytes are read, other kinds are not", "[map_file]") {
  // POINT(1 2), big endian, as another program may write it.
  const Bytes point{'G', 'P', 0, 0, 0, 0, 0,    0, 0, 0, 0, 0, 1, 0x3F, 0xF0,
                    0,   0,   0, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0, 0};
  const auto read = geometry_of(point);
  REQUIRE(read);
  CHECK(read->points_m == std::vector<Eigen::Vector2d>{{1.0, 2.0}});

  Bytes other = point;
  other[12] = 4;  // MULTIPOINT
  CHECK_FALSE(geometry_of(other));
  other = point;
  other[3] = 1U << 4U;  // empty
  CHECK_FALSE(geometry_of(other));
  other = point;
  other[13] = 0x7F;  // not finite
  CHECK_FALSE(geometry_of(other));
}

TEST_CASE("hostile counts of points are not believed", "[map_file]") {
  auto bytes = map_file::geometry_blob({GeometryKind::kLine, {{0, 0}, {1, 1}}});
  for (std::size_t i = 45; i < 49; ++i) bytes[i] = 0xFF;
  CHECK_FALSE(geometry_of(bytes));
  std::mt19937_64 random(22);
  for (int run = 0; run < 20'000; ++run) {
    auto hostile = map_file::geometry_blob({GeometryKind::kPolygon, {{0, 0}, {1, 1}, {2, 0}}});
    for (int i = 0; i < 3; ++i)
      hostile[random() % hostile.size()] = static_cast<std::uint8_t>(random());
    if (const auto geometry = geometry_of(hostile)) CHECK(geometry->points_m.size() < 10);
  }
}
