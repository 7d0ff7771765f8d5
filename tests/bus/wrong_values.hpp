// Every wrong value of a parameter, made from its description.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <variant>

#include "common/bus/parameter_table.hpp"
#include "tests/catch.hpp"

namespace understory::test {

/// Loads "KEY = VALUE", in line 2 of toy.toml, into a table like the one under test; gives the
/// complaint, empty = it was taken.
using ProblemWith = std::function<std::string(const std::string& key, const std::string& value)>;

inline void check_refused(const bus::ParameterTable::Entry& entry, const std::string& value,
                          const std::string& what, const ProblemWith& problem_with) {
  const std::string problem = problem_with(entry.key, value);
  INFO(entry.key << " = " << value << ": " << problem);
  CHECK(problem.rfind("toy.toml:2: " + entry.key + ": ", 0) == 0);
  CHECK(problem.find(what) != std::string::npos);
  CHECK(problem.find(allowed(entry)) != std::string::npos);
}

/// Below, above, not finite, of another type, misspelt: each is refused with file, line, key, what
/// is wrong and what is allowed.
inline void check_every_wrong_value(const bus::ParameterTable::Entry& entry,
                                    const ProblemWith& problem_with) {
  const auto refused = [&](const std::string& value, const std::string& what) {
    check_refused(entry, value, what, problem_with);
  };

  if (const auto* number = std::get_if<bus::ParameterTable::Number>(&entry.target)) {
    const double below = number->range.lowest - std::max(1e-3, std::abs(number->range.lowest));
    const double above = number->range.highest * 2.0 + 1.0;
    refused(std::to_string(below), "too small");
    refused(std::to_string(above), "too large");
    refused("9007199254740993", "more digits than a real number holds");     // 2^53 + 1
    refused("9223372036854775807", "more digits than a real number holds");  // 2^63 - 1
    if (number->range.highest < 0x1p53) refused("9007199254740994", "too large");
    refused("nan", "not finite");
    refused("inf", "not finite");
    refused("\"1.0\"", "not a number");
  } else if (const auto* integer = std::get_if<bus::ParameterTable::Integer>(&entry.target)) {
    refused(std::to_string(std::int64_t{integer->range.lowest} - 1), "too small");
    refused(std::to_string(std::int64_t{integer->range.highest} + 1), "too large");
    refused("9000000000000000000", "too large");
    refused("nan", "not a whole number");
    refused("1.5", "not a whole number");
    refused("true", "not a whole number");
  } else if (std::holds_alternative<bus::ParameterTable::Boolean>(entry.target)) {
    refused("1", "neither true nor false");
    refused("\"true\"", "neither true nor false");
  } else {
    const auto& text = std::get<bus::ParameterTable::Text>(entry.target);
    refused("3", "not text");
    if (!text.choices.empty()) refused("\"no such\"", "not known");
  }

  const std::string unknown = problem_with(entry.key + "x", "1");
  INFO(entry.key << "x: " << unknown);
  CHECK(unknown.find("unknown key; the nearest valid one is " + entry.key) != std::string::npos);
}

}  // namespace understory::test
