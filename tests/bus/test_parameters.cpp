// Configuration: for every parameter, each way of being wrong is refused by name.
#include <cmath>

#include "tests/bus/toy_service.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::test;

namespace {

struct Described {
  RuntimeParameters runtime;
  ToyAdapter toy;
  ParameterTable table;
  Described() {
    describe(runtime, table);
    toy.describe(table);
  }
};

/// What loading this says; empty = it was taken.
std::string problem_with(const std::string& key, const std::string& value) {
  Described described;
  try {
    described.table.load_text("\n" + key + " = " + value + "\n", "toy.toml");
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return {};
}

void check_refused(const ParameterTable::Entry& entry, const std::string& value,
                   const std::string& what) {
  const std::string problem = problem_with(entry.key, value);
  INFO(entry.key << " = " << value << ": " << problem);
  CHECK(problem.rfind("toy.toml:2: " + entry.key + ": ", 0) == 0);
  CHECK(problem.find(what) != std::string::npos);
  CHECK(problem.find(allowed(entry)) != std::string::npos);
}

}  // namespace

TEST_CASE("every parameter refuses what it cannot be, with file, line, key, value and range") {
  const Described described;
  for (const ParameterTable::Entry& entry : described.table.entries()) {
    if (const auto* number = std::get_if<ParameterTable::Number>(&entry.target)) {
      const double below = number->range.lowest - std::max(1e-3, std::abs(number->range.lowest));
      const double above = number->range.highest * 2.0 + 1.0;
      check_refused(entry, std::to_string(below), "too small");
      check_refused(entry, std::to_string(above), "too large");
      check_refused(entry, "nan", "not finite");
      check_refused(entry, "inf", "not finite");
      check_refused(entry, "\"1.0\"", "not a number");
    } else if (const auto* integer = std::get_if<ParameterTable::Integer>(&entry.target)) {
      check_refused(entry, std::to_string(std::int64_t{integer->range.lowest} - 1), "too small");
      check_refused(entry, std::to_string(std::int64_t{integer->range.highest} + 1), "too large");
      check_refused(entry, "9000000000000000000", "too large");
      check_refused(entry, "nan", "not a whole number");
      check_refused(entry, "1.5", "not a whole number");
      check_refused(entry, "true", "not a whole number");
    } else if (std::holds_alternative<ParameterTable::Boolean>(entry.target)) {
      check_refused(entry, "1", "neither true nor false");
      check_refused(entry, "\"true\"", "neither true nor false");
    } else {
      const auto& text = std::get<ParameterTable::Text>(entry.target);
      check_refused(entry, "3", "not text");
      if (!text.choices.empty()) check_refused(entry, "\"no such\"", "not known");
    }
    const std::string unknown = problem_with(entry.key + "x", "1");
    CHECK(unknown.find("unknown key; the nearest valid one is " + entry.key) != std::string::npos);
  }
}

TEST_CASE("the printed file loads, and changes nothing") {
  Described described;
  described.table.load_text("[toy]\ngain = 2.5\nnegate = true\nmode = \"throwing\"", "a.toml");
  const std::string printed = described.table.to_toml();
  CHECK(printed.find("gain = 2.5") != std::string::npos);
  Described again;
  again.table.load_text(printed, "printed.toml");
  CHECK(again.table.to_toml() == printed);
}

TEST_CASE("keys without a table are printed before every table") {
  double first = 1.0;
  double second = 2.0;
  ParameterTable table;
  table.add("part.first", first, {0.0, 9.0}, "m", "One.");
  table.add("second", second, {0.0, 9.0}, "m", "Two.");
  table.load_text("second = 3\n[part]\nfirst = 4\n", "x.toml");
  CHECK(first == 4.0);
  CHECK(second == 3.0);
  const std::string printed = table.to_toml();
  first = second = 0.0;
  table.load_text(printed, "y.toml");
  CHECK(first == 4.0);
  CHECK(second == 3.0);
}

TEST_CASE("a file with one mistake sets nothing, and all mistakes are named") {
  Described described;
  const std::string before = described.table.to_toml();
  try {
    described.table.load_text("[toy]\ngain = 3\nevery = 0\nnegat = true\n", "toy.toml");
    FAIL("taken");
  } catch (const ConfigurationError& error) {
    REQUIRE(error.problems().size() == 2);
    CHECK(error.problems()[0] ==
          "toy.toml:3: toy.every: 0 is too small; allowed: 1 .. 100 messages");
    CHECK(error.problems()[1] ==
          "toy.toml:4: toy.negat: unknown key; the nearest valid one is toy.negate");
  }
  CHECK(described.table.to_toml() == before);
  CHECK_THROWS_WITH(described.table.load_text("[toy\n", "toy.toml"),
                    Catch::Matchers::StartsWith("toy.toml:"));
  CHECK_THROWS_WITH(described.table.load("/no/such/file.toml"),
                    "/no/such/file.toml: cannot be read");
}
