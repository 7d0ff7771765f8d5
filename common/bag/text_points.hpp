// Points that a file has as numbers in text.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/bag/cloud_fields.hpp"

namespace understory::bag {

/// A column of the text.
struct TextField {
  std::string name;  ///< For messages.
  FieldType type = FieldType::kFloat32;
  std::uint32_t bytes = 4;  ///< Of a value.
  std::uint32_t count = 1;  ///< Values.
  bool is_read = true;      ///< Else its words are passed over, whatever they are.
};

/// `points` points with these fields, packed, in the types that the fields have. Throws
/// io::DataError, which names `source`, word and field.
std::vector<std::uint8_t> points_of_text(std::span<const TextField> fields, std::uint64_t points,
                                         std::string_view text, std::string_view source);

}  // namespace understory::bag
