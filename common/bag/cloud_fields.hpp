// Numbers of any type in the points of a PointCloud2.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// Types of a field: those of PointField, and two more of PCD files.
enum class FieldType : std::uint8_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kFloat32 = 7,
  kFloat64 = 8,
  kInt64 = 9,
  kUint64 = 10,
};

/// Reads one field of a point. find_field() has checked that the field lies within the point.
class FieldReader {
 public:
  /// Reads this field, in this byte order.
  FieldReader(const PointField& field, bool is_big_endian)
      : field_(field),
        is_big_endian_(is_big_endian),
        is_plain_float_(type() == FieldType::kFloat32 &&
                        is_big_endian == (std::endian::native == std::endian::big)) {}

  /// The field's value of the point that begins here.
  double value(const std::uint8_t* point) const {
    if (!is_plain_float_) return converted(point);
    // The most frequent case, without a call.
    float plain = 0.0F;
    std::memcpy(&plain, point + field_.offset, sizeof plain);
    return static_cast<double>(plain);
  }
  /// The same for an integer field; 0 for floats.
  std::int64_t integer(const std::uint8_t* point) const;
  /// Whether the field has an integer type.
  bool is_integer() const { return type() != FieldType::kFloat32 && type() != FieldType::kFloat64; }
  FieldType type() const { return static_cast<FieldType>(field_.type); }
  std::string_view name() const { return field_.name; }  ///< Name of the field.
  std::string type_name() const;                         ///< Type as text: "float32".

 private:
  double converted(const std::uint8_t* point) const;

  PointField field_;
  bool is_big_endian_;
  bool is_plain_float_;  ///< float32 in the byte order of this computer.
};

/// The first of these names that the cloud has. Throws io::DataError where the field does not lie
/// within a point or has an unknown type.
std::optional<FieldReader> find_field(const PointCloud& cloud,
                                      std::span<const std::string_view> names);

/// Layout of the points.
struct CloudRows {
  std::uint32_t rows = 0;
  std::uint32_t columns = 0;
  std::uint64_t row_bytes = 0;    ///< From one row to the next.
  std::uint64_t point_bytes = 0;  ///< From one point to the next.

  /// Number of points.
  std::uint64_t points() const { return std::uint64_t{rows} * columns; }
  /// Address of a point in the data that rows_of() checked.
  const std::uint8_t* at(std::span<const std::uint8_t> data, std::uint32_t row,
                         std::uint32_t column) const {
    return data.data() + row * row_bytes + column * point_bytes;
  }
};

/// Height, width and steps, compared with the data. A row step that is too small for its points is
/// ignored. Throws io::DataError where the data is too short.
CloudRows rows_of(const PointCloud& cloud);

/// The name of a PointField's type: "float32".
std::string field_type_name(std::uint8_t type);

}  // namespace understory::bag
