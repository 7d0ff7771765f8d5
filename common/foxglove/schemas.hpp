// JSON Schemas of the well-known messages in use, and functions to build one.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace understory::foxglove {

/// One property of an object.
struct Property {
  std::string_view name;
  std::string schema;
  bool is_required = true;
};

/// Schema of an object with this title.
std::string object_schema(std::string_view title, const std::vector<Property>& properties);
/// {sec, nsec} since the epoch.
std::string time_schema();

/// Schemas by name (foxglove.Log), from `@foxglove/schemas` 2.1.0 without descriptions. A test
/// compares them.
std::map<std::string_view, std::string> well_known_schemas();

}  // namespace understory::foxglove
