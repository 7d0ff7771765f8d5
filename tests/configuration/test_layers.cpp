// Files that build on others by their key `base`.
#include <filesystem>
#include <fstream>

#include "common/bus/launch_config.hpp"
#include "common/bus/parameter_table.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
namespace fs = std::filesystem;

namespace {

struct Values {
  double range_m = 1.0;
  double noise_m = 1.0;
  int scans = 1;
  bus::ParameterTable table;
  Values() {
    table.add("laser.range_m", range_m, {0.0, 100.0}, "m", "Range.");
    table.add("laser.noise_m", noise_m, {0.0, 100.0}, "m", "Noise.");
    table.add("scans", scans, {1, 9}, "", "Scans.");
  }
};

/// Folders with files below a temporary one.
struct Folders {
  test::TemporaryDirectory directory;
  fs::path write(const std::string& name, const std::string& text) const {
    const fs::path file = fs::path(directory.path()) / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return file;
  }
  fs::path folder(const std::string& name) const { return fs::path(directory.path()) / name; }
};

std::string problem_of(const fs::path& file) {
  Values values;
  try {
    values.table.load(file);
  } catch (const bus::ConfigurationError& error) {
    CHECK(values.range_m == 1.0);  // Nothing has been set.
    return error.what();
  }
  return "accepted";
}

std::string launch_problem_of(const fs::path& folder) {
  try {
    bus::read_launch_config(folder);
  } catch (const bus::ConfigurationError& error) {
    return error.what();
  }
  return "accepted";
}

const std::string kTwo =
    "[[process]]\nname = \"ekf\"\nexecutable = \"understory-ekf\"\nconfig = \"ekf.toml\"\n"
    "[[process]]\nname = \"mapper\"\nexecutable = \"understory-mapper\"\nconfig = "
    "\"mapper.toml\"\n";

}  // namespace

TEST_CASE("a file's values replace those of its base, one by one", "[configuration]") {
  const Folders folders;
  folders.write("a/x.toml", "scans = 2\n[laser]\nrange_m = 20.0\nnoise_m = 0.2\n");
  folders.write("b/x.toml", "base = \"../a/x.toml\"\n[laser]\nnoise_m = 0.3\n");
  const fs::path file = folders.write("c/x.toml", "scans = 4\nbase = \"../b/x.toml\"\n");
  Values values;
  values.table.load(file);
  CHECK(values.range_m == 20.0);
  CHECK(values.noise_m == 0.3);
  CHECK(values.scans == 4);

  Values alone;
  alone.table.load(folders.write("d/x.toml", "base = \"\"\nscans = 5\n"));
  CHECK(alone.scans == 5);
  CHECK(alone.range_m == 1.0);
}

TEST_CASE("what is wrong with a base names the file, the line and the key", "[configuration]") {
  const Folders folders;
  const fs::path good = folders.write("a/x.toml", "base = \"../base/x.toml\"\nscans = 2\n");
  CHECK_THAT(problem_of(good), Contains("a/x.toml:1: base: no file ") && EndsWith("base/x.toml"));

  const fs::path base = folders.write("base/x.toml", "\n[laser]\ncolour = 1\n");
  CHECK_THAT(problem_of(good), Contains(base.string() + ":3: laser.colour: unknown key"));
  folders.write("base/x.toml", "\n[laser]\nrange_m = 101\n");
  CHECK_THAT(problem_of(good), Contains(base.string() + ":3: laser.range_m: 101 is too large"));
  folders.write("base/x.toml", "[laser");
  CHECK_THAT(problem_of(good), Contains(base.string() + ":1: "));
  folders.write("base/x.toml", "scans = 1\nbase = \"../a/x.toml\"\n");
  CHECK_THAT(problem_of(good), Contains(base.string() + ":2: base: leads back: "));

  CHECK_THAT(problem_of(folders.write("c/x.toml", "\nbase = 3\n")),
             EndsWith("x.toml:2: base: must be a path in quotes"));
  CHECK_THAT(problem_of(folders.write("c/x.toml", "base = \"x.toml\"\n")),
             Contains("c/x.toml:1: base: leads back: "));
  CHECK_THAT(problem_of(folders.write("c/x.toml", "base = \"../a\"\n")),
             Contains("c/x.toml:1: base: no file "));

  int value = 0;
  bus::ParameterTable table;
  CHECK_THROWS_AS(table.add("base", value, {0, 1}, "", "Taken."), std::logic_error);
}

TEST_CASE("a folder starts its base's processes, with its own files where it has them",
          "[configuration]") {
  const Folders folders;
  folders.write("base/launch.toml", kTwo);
  folders.write("base/ekf.toml", "");
  folders.write("base/mapper.toml", "");
  folders.write("car/launch.toml",
                "base = \"../base\"\n[[process]]\nname = \"driver\"\nexecutable = \"d\"\n");
  folders.write("car/mapper.toml", "base = \"../base/mapper.toml\"\n");

  const auto processes = bus::read_launch_config(folders.folder("car")).processes;
  REQUIRE(processes.size() == 3);
  CHECK(processes[0].config == folders.folder("base/ekf.toml"));
  CHECK(processes[1].config == folders.folder("car/mapper.toml"));
  CHECK(processes[2].name == "driver");
  CHECK(bus::config_file_in(folders.folder("car"), "ekf") == folders.folder("base/ekf.toml"));
  CHECK(bus::config_file_in(folders.folder("car"), "driver").empty());

  // A process of the base with another executable.
  folders.write("car/launch.toml",
                "base = \"../base\"\n[[process]]\nname = \"ekf\"\nexecutable = \"other\"\n");
  const auto replaced = bus::read_launch_config(folders.folder("car")).processes;
  REQUIRE(replaced.size() == 2);
  CHECK(replaced[0].executable == "other");
}

TEST_CASE("a base of launch.toml that cannot be used is named", "[configuration]") {
  const Folders folders;
  folders.write("car/launch.toml", "\nbase = \"../base\"\n");
  const fs::path car = folders.folder("car");
  CHECK_THAT(launch_problem_of(car),
             Contains("car/launch.toml:2: base: no file ") && EndsWith("base/launch.toml"));
  folders.write("base/launch.toml", "base = \"../car\"\n");
  CHECK_THAT(launch_problem_of(car), Contains("base/launch.toml:1: base: leads back: "));
  folders.write("base/launch.toml", kTwo);
  CHECK_THAT(launch_problem_of(car), Contains("base/launch.toml:4: config: no file"));

  // A file that would take the place of the base's, values and all, in silence.
  folders.write("base/ekf.toml", "");
  folders.write("base/mapper.toml", "");
  CHECK(launch_problem_of(car) == "accepted");
  folders.write("car/ekf.toml", "scans = 2\n");
  CHECK_THAT(launch_problem_of(car),
             Contains("car/ekf.toml:1: base: missing; state base = \"../base/ekf.toml\""));
  folders.write("car/ekf.toml", "base = \"\"\nscans = 2\n");
  CHECK(launch_problem_of(car) == "accepted");
}
