// Points from numbers in a text file.
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
  std::string name;  ///< Name for error messages.
  FieldType type = FieldType::kFloat32;
  std::uint32_t bytes = 4;  ///< Bytes of a value.
  std::uint32_t count = 1;  ///< Number of values.
  bool is_read = true;      ///< Else its words are skipped without a check.
};

/// Reads `points` points with these fields and returns them packed in the fields' types. Throws
/// io::DataError with `source`, word and field.
std::vector<std::uint8_t> points_of_text(std::span<const TextField> fields, std::uint64_t points,
                                         std::string_view text, std::string_view source);

}  // namespace understory::bag
