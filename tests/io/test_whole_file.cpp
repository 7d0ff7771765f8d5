#include <filesystem>
#include <fstream>

#include "common/io/data_error.hpp"
#include "common/io/whole_file.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

namespace understory::io {
namespace {

std::size_t names_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST_CASE("a file in pieces takes its name when it is whole") {
  const test::TemporaryDirectory directory;
  const auto path = directory / "out";
  std::ofstream(path) << "before";
  {
    WholeFile file(path);
    file.write("one ");
    file.write("two");
    REQUIRE(file.size() == 7);
    REQUIRE(content(path) == "before");
    file.commit();
  }
  REQUIRE(content(path) == "one two");
  REQUIRE(names_in(directory.path()) == 1);
}

TEST_CASE("a file that was not finished leaves nothing behind") {
  const test::TemporaryDirectory directory;
  { WholeFile(directory / "out").write("one"); }
  REQUIRE(names_in(directory.path()) == 0);
}

TEST_CASE("links are followed, devices written, errors name the file") {
  const test::TemporaryDirectory directory;
  std::filesystem::create_symlink(directory / "target", directory / "link");
  WholeFile file(directory / "link");
  file.write("x");
  file.commit();
  REQUIRE(std::filesystem::is_symlink(directory / "link"));
  REQUIRE(content(directory / "target") == "x");

  REQUIRE_THROWS_WITH(WholeFile("/dev/full").write("x"), Catch::Matchers::Contains("/dev/full"));
  REQUIRE_THROWS_AS(WholeFile(directory / "none" / "out"), DataError);
}

}  // namespace
}  // namespace understory::io
