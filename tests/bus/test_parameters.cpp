// Configuration: for every parameter, each kind of wrong value is refused by name.
#include <array>
#include <string>

#include "common/bus/config_file.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/bus/wrong_values.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;

namespace {

struct Described {
  RuntimeParameters runtime;
  test::ToyAdapter toy;
  ParameterTable table;
  Described() {
    describe(runtime, table);
    toy.describe(table);
  }
};

/// The error of loading this; empty = it was taken.
std::string problem_with(const std::string& key, const std::string& value) {
  Described described;
  try {
    described.table.load_text("\n" + key + " = " + value + "\n", "toy.toml");
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("every parameter refuses what it cannot be, with file, line, key, value and range") {
  const Described described;
  for (const ParameterTable::Entry& entry : described.table.entries()) {
    check_every_wrong_value(entry, problem_with);
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

TEST_CASE("a whole number for a real parameter is taken where a double is equal to it") {
  double value = 0.0;
  ParameterTable table;
  table.add("value", value, {-1e300, 1e300}, "", "Any.");
  for (const auto& [text, expected] :
       {std::pair("7", 7.0), std::pair("-3", -3.0), std::pair("9007199254740992", 0x1p53),
        std::pair("9007199254740994", 0x1p53 + 2.0), std::pair("4611686018427387904", 0x1p62),
        std::pair("-9223372036854775808", -0x1p63)}) {
    table.load_text(std::string("value = ") + text + "\n", "x.toml");
    CHECK(value == expected);
  }
  for (const std::string text :
       {"9007199254740993", "-9007199254740993", "9223372036854775807", "4611686018427387905"}) {
    CHECK_THROWS_WITH(table.load_text("value = " + text + "\n", "x.toml"),
                      Catch::Matchers::StartsWith("x.toml:1: value: " + text + " has more digits"));
  }
}

TEST_CASE("a folder or a missing file for a configuration is refused by its path") {
  const test::Scratch scratch("config-folder");
  const std::string folder = scratch.path().string();
  const std::string refusal = folder + ": is a folder, not a configuration file";
  CHECK_THROWS_WITH(read_config_file(folder), refusal);
  CHECK_THROWS_WITH(Described().table.load(folder), refusal);
  CHECK_THROWS_WITH(read_config_file(folder + "/none.toml"), folder + "/none.toml: cannot be read");

  std::array<std::string, 4> words{"toy", "--config", folder, "--print-config"};
  std::array<char*, 4> arguments{};
  for (std::size_t i = 0; i < words.size(); ++i) arguments[i] = words[i].data();
  CHECK(run_service(test::toy_service(), 4, arguments.data()) == 2);
}
