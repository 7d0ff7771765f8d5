#include "common/bag/cloud_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

constexpr std::array<std::size_t, 11> kTypeBytes{0, 1, 1, 2, 2, 4, 4, 4, 8, 8, 8};
constexpr std::array<std::string_view, 11> kTypeNames{"?",       "int8",  "uint8",  "int16",
                                                      "uint16",  "int32", "uint32", "float32",
                                                      "float64", "int64", "uint64"};

constexpr std::uint64_t kMostPoints = 20'000'000;

template <class T>
T number_from(const std::uint8_t* at, bool is_big_endian) {
  std::array<std::uint8_t, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), at, sizeof(T));
  if (is_big_endian == (std::endian::native == std::endian::little))
    std::reverse(bytes.begin(), bytes.end());
  T value{};
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

}  // namespace

std::string field_type_name(std::uint8_t type) {
  return std::string(kTypeNames[type < kTypeNames.size() ? type : 0]);
}

std::string FieldReader::type_name() const { return field_type_name(field_.type); }

std::int64_t FieldReader::integer(const std::uint8_t* point) const {
  const std::uint8_t* at = point + field_.offset;
  switch (type()) {
    case FieldType::kInt8:
      return number_from<std::int8_t>(at, is_big_endian_);
    case FieldType::kUint8:
      return *at;
    case FieldType::kInt16:
      return number_from<std::int16_t>(at, is_big_endian_);
    case FieldType::kUint16:
      return number_from<std::uint16_t>(at, is_big_endian_);
    case FieldType::kInt32:
      return number_from<std::int32_t>(at, is_big_endian_);
    case FieldType::kUint32:
      return number_from<std::uint32_t>(at, is_big_endian_);
    case FieldType::kInt64:
      return number_from<std::int64_t>(at, is_big_endian_);
    case FieldType::kUint64:
      return static_cast<std::int64_t>(number_from<std::uint64_t>(at, is_big_endian_));
    default:
      return 0;
  }
}

double FieldReader::converted(const std::uint8_t* point) const {
  const std::uint8_t* at = point + field_.offset;
  if (type() == FieldType::kFloat32)
    return static_cast<double>(number_from<float>(at, is_big_endian_));
  if (type() == FieldType::kFloat64) return number_from<double>(at, is_big_endian_);
  return static_cast<double>(integer(point));
}

std::optional<FieldReader> find_field(const PointCloud& cloud,
                                      std::span<const std::string_view> names) {
  for (const std::string_view name : names) {
    const auto field = std::ranges::find(cloud.fields, name, &PointField::name);
    if (field == cloud.fields.end()) continue;
    if (field->type == 0 || field->type >= kTypeBytes.size())
      throw io::DataError(
          fmt::format("field {} has type {}, which there is not", name, field->type));
    if (std::uint64_t{field->offset} + kTypeBytes[field->type] > cloud.point_step)
      throw io::DataError(fmt::format("field {} at byte {} does not lie in a point of {} bytes",
                                      name, field->offset, cloud.point_step));
    return FieldReader(*field, cloud.is_big_endian);
  }
  return std::nullopt;
}

CloudRows rows_of(const PointCloud& cloud) {
  CloudRows rows{cloud.height, cloud.width, cloud.row_step, cloud.point_step};
  if (rows.points() == 0) return {};
  if (cloud.point_step == 0) throw io::DataError("a cloud whose points have no bytes");
  if (rows.points() > kMostPoints)
    throw io::DataError(
        fmt::format("{} points, more than the {} that are read", rows.points(), kMostPoints));
  const std::uint64_t least = std::uint64_t{cloud.width} * cloud.point_step;
  if (rows.rows == 1 || rows.row_bytes < least) rows.row_bytes = least;

  // Rows and steps have 32 bits each: no product overflows 64.
  const std::uint64_t last = (rows.rows - std::uint64_t{1}) * rows.row_bytes;
  if (last > cloud.data.size() || least > cloud.data.size() - last)
    throw io::DataError(fmt::format("{} x {} points of {} bytes in {} bytes of data", cloud.height,
                                    cloud.width, cloud.point_step, cloud.data.size()));
  return rows;
}

}  // namespace understory::bag
