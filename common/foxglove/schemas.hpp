// JSON Schemas of the well-known messages that are used, and how one is put together.
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

/// By name (foxglove.Log): those of `@foxglove/schemas` 2.1.0, without their descriptions. A test
/// compares them.
std::map<std::string_view, std::string> well_known_schemas();

}  // namespace understory::foxglove
