// Byte layouts of the wire types as data, generated from lcmtypes/*.lcm by the build.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace understory::wire {

/// LCM's types of fields.
enum class FieldKind : std::uint8_t {
  kInt8,
  kInt16,
  kInt32,
  kInt64,
  kBoolean,
  kByte,
  kFloat,
  kDouble,
  kString,
  kStruct,
};

struct Layout;

/// A field has `fixed` elements, times the count in slot `counted_by` if that is not -1.
struct Field {
  std::string_view name;
  FieldKind kind = FieldKind::kByte;
  const Layout* part = nullptr;  ///< Layout of a kStruct.
  std::uint32_t fixed = 1;
  int counted_by = -1;
  int counts = -1;  ///< The slot for this integer's value; -1 = it is not a count.
};

/// A struct may have this many counts.
inline constexpr std::size_t kMostCounts = 8;

/// The fields of a type in the order of their bytes.
struct Layout {
  std::string_view name;
  std::span<const Field> fields;
  std::size_t min_bytes = 0;  ///< Least size, without the fingerprint.
};

/// A type of lcmtypes/.
struct WireType {
  const Layout* layout = nullptr;
  std::int64_t (*fingerprint)() = nullptr;  ///< LCM's hash of names and types.
  bool is_message = false;  ///< Begins with utime and seq: it has a channel of its own.
};

/// Every type of lcmtypes/, in order of name.
std::span<const WireType> wire_types();

/// By name (`landmarks_t`); null = none.
const WireType* find_wire_type(std::string_view name);
/// By fingerprint; null = none.
const WireType* find_wire_type(std::int64_t fingerprint);

}  // namespace understory::wire
