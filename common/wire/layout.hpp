// How each wire type's bytes lie, as data: generated from lcmtypes/*.lcm when the project is built.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace understory::wire {

/// The types of fields that LCM has.
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

/// A field holds `fixed` elements, times the count in slot `counted_by` where that is not -1.
struct Field {
  std::string_view name;
  FieldKind kind = FieldKind::kByte;
  const Layout* part = nullptr;  ///< Of kStruct.
  std::uint32_t fixed = 1;
  int counted_by = -1;
  int counts = -1;  ///< The slot that this integer's value fills; -1 = it counts nothing.
};

/// A struct may have this many counts.
inline constexpr std::size_t kMostCounts = 8;

/// The fields of a type in the order of their bytes.
struct Layout {
  std::string_view name;
  std::span<const Field> fields;
  std::size_t min_bytes = 0;  ///< Of the shortest one, without the fingerprint.
};

/// A type of lcmtypes/.
struct WireType {
  const Layout* layout = nullptr;
  std::int64_t (*fingerprint)() = nullptr;  ///< LCM's hash of names and types.
  bool is_message = false;  ///< Begins with utime and seq: it travels on a channel of its own.
};

/// Every type of lcmtypes/, in order of name.
std::span<const WireType> wire_types();

/// By name (`landmarks_t`); null where there is none.
const WireType* find_wire_type(std::string_view name);
/// By fingerprint; null where there is none.
const WireType* find_wire_type(std::int64_t fingerprint);

}  // namespace understory::wire
