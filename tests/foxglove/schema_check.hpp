// A JSON value against a JSON Schema, as far as the schemas here go.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace understory::test {

/// What does not agree, with its place; empty = nothing. Properties that the schema does not name
/// do not agree.
inline std::string disagreement(const nlohmann::json& value, const nlohmann::json& schema,
                                const std::string& place = "") {
  if (schema.contains("oneOf")) {
    for (const auto& one : schema["oneOf"]) {
      if (one["const"] == value) return "";
    }
    return place + ": none of the values";
  }
  const std::string type = schema.at("type");
  const bool fits =
      (type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
      (type == "string" && value.is_string()) || (type == "boolean" && value.is_boolean()) ||
      (type == "integer" && value.is_number_integer()) || (type == "number" && value.is_number());
  if (!fits) return place + ": not a " + type;
  if (schema.contains("minimum") && value < schema["minimum"]) return place + ": too small";
  if (schema.contains("maximum") && value > schema["maximum"]) return place + ": too large";
  if (schema.contains("minItems") && value.size() < schema["minItems"]) return place + ": few";
  if (schema.contains("maxItems") && value.size() > schema["maxItems"]) return place + ": many";

  if (type == "array") {
    for (std::size_t i = 0; i < value.size(); ++i) {
      const auto one = disagreement(value[i], schema["items"], place + "/" + std::to_string(i));
      if (!one.empty()) return one;
    }
  }
  if (type != "object") return "";
  if (schema.contains("required")) {
    for (const std::string name : schema["required"]) {
      if (!value.contains(name)) return place + ": no " + name;
    }
  }
  for (const auto& [name, part] : value.items()) {
    if (!schema["properties"].contains(name)) return place + ": " + name + " is not of the schema";
    const auto one = disagreement(part, schema["properties"][name], place + "/" + name);
    if (!one.empty()) return one;
  }
  return "";
}

}  // namespace understory::test
