// Clouds of any layout, made from points.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "common/bag/messages.hpp"
#include "tests/bag/message_writer.hpp"

namespace understory::test {

using Random = std::mt19937_64;
constexpr std::int64_t kStamp = 1'700'000'000'100'000'000;

/// A point as the sensor has it.
struct Truth {
  Eigen::Vector3f position_m;
  double time_s = 0.0;  ///< From the stamp.
  std::uint32_t ring = 0;
  int intensity = 0;
};

/// A revolution of 0.1 s with 16 rings, rings upwards.
inline std::vector<Truth> revolution(Random& random, std::size_t firings = 60) {
  std::vector<Truth> points;
  for (std::size_t firing = 0; firing < firings; ++firing) {
    const double azimuth = -2.0 * M_PI * static_cast<double>(firing) / static_cast<double>(firings);
    for (std::uint32_t ring = 0; ring < 16; ++ring) {
      const double range = 3.0 + static_cast<double>(random() % 1000) * 0.05;
      const double elevation = (-15.0 + 2.0 * ring) * M_PI / 180.0;
      points.push_back({Eigen::Vector3d(range * std::cos(elevation) * std::cos(azimuth),
                                        range * std::cos(elevation) * std::sin(azimuth),
                                        range * std::sin(elevation))
                            .cast<float>(),
                        0.1 * static_cast<double>(firing) / static_cast<double>(firings), ring,
                        static_cast<int>(random() % 256)});
    }
  }
  return points;
}

/// What a driver puts into a field.
struct FieldForm {
  std::string name;
  std::uint8_t type = 7;
  std::function<double(const Truth&)> value;
};

inline std::size_t type_bytes(std::uint8_t type) {
  return std::array<std::size_t, 9>{0, 1, 1, 2, 2, 4, 4, 4, 8}.at(type);
}

template <class T>
void put_number(std::uint8_t* at, double value, bool is_big_endian) {
  const T number = static_cast<T>(value);
  std::array<std::uint8_t, sizeof(T)> raw{};
  std::memcpy(raw.data(), &number, sizeof(T));
  if (is_big_endian) std::reverse(raw.begin(), raw.end());
  std::copy(raw.begin(), raw.end(), at);
}

inline void put(std::uint8_t* at, std::uint8_t type, double value, bool big) {
  switch (type) {
    case 1:
      return put_number<std::int8_t>(at, value, big);
    case 2:
      return put_number<std::uint8_t>(at, value, big);
    case 3:
      return put_number<std::int16_t>(at, value, big);
    case 4:
      return put_number<std::uint16_t>(at, value, big);
    case 5:
      return put_number<std::int32_t>(at, value, big);
    case 6:
      return put_number<std::uint32_t>(at, value, big);
    case 7:
      return put_number<float>(at, value, big);
    default:
      return put_number<double>(at, value, big);
  }
}

/// A cloud and the bytes to which it refers.
struct Made {
  bag::PointCloud cloud;
  std::vector<std::uint8_t> data;
};

inline std::vector<FieldForm> positions(std::uint8_t type = 7) {
  return {{"x", type, [](const Truth& p) { return p.position_m.x(); }},
          {"y", type, [](const Truth& p) { return p.position_m.y(); }},
          {"z", type, [](const Truth& p) { return p.position_m.z(); }}};
}

/// Fields in random order with gaps; `rows`: 1 = unordered; rows padded at random.
inline std::unique_ptr<Made> make_cloud(Random& random, const std::vector<Truth>& points,
                                        std::vector<FieldForm> fields, std::uint32_t rows = 1) {
  auto made = std::make_unique<Made>();
  bag::PointCloud& cloud = made->cloud;
  cloud.header = {kStamp, "laser"};
  cloud.is_big_endian = random() % 2 == 0;
  std::shuffle(fields.begin(), fields.end(), random);
  for (const FieldForm& field : fields) {
    cloud.point_step += static_cast<std::uint32_t>(random() % 5);
    cloud.fields.push_back({field.name, cloud.point_step, field.type, 1});
    cloud.point_step += static_cast<std::uint32_t>(type_bytes(field.type));
  }
  cloud.point_step += static_cast<std::uint32_t>(random() % 5);
  cloud.height = rows;
  cloud.width = static_cast<std::uint32_t>(points.size()) / rows;
  cloud.row_step = cloud.width * cloud.point_step;
  if (rows > 1) cloud.row_step += static_cast<std::uint32_t>(random() % 9);
  // Some drivers leave it zero.
  const std::uint32_t step = cloud.row_step;
  if (rows == 1 && random() % 2 == 0) cloud.row_step = 0;

  made->data.resize(std::size_t{rows} * step);
  for (auto& byte : made->data) byte = static_cast<std::uint8_t>(random());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::uint8_t* at = made->data.data() + std::size_t{i / cloud.width} * step +
                       std::size_t{i % cloud.width} * cloud.point_step;
    for (std::size_t f = 0; f < fields.size(); ++f)
      put(at + cloud.fields[f].offset, fields[f].type, fields[f].value(points[i]),
          cloud.is_big_endian);
  }
  cloud.data = made->data;
  return made;
}

}  // namespace understory::test
