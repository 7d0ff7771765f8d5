// Files that are written whole, and what stands at their name: links, devices, pipes.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/output_file.hpp"
#include "common/io/text_file.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;
using namespace understory::io;
using namespace understory::test;
namespace fs = std::filesystem;

TEST_CASE("a file is replaced as a whole, or stays as it was", "[output]") {
  const test::TemporaryDirectory directory;
  const fs::path file = directory / "a.json";
  write_whole_file(file, "one");
  write_whole_file(file, "two");
  CHECK(read_whole_file(file) == "two");
  CHECK(std::distance(fs::directory_iterator(directory.path()), {}) == 1);

  CHECK_THROWS_AS(write_whole_file(directory / "none/a.json", "x"), DataError);
  CHECK_THROWS_AS(write_whole_file(directory.path(), "x"), DataError);
  CHECK_THROWS_AS(write_whole_file("/dev/full", "x"), DataError);
}

TEST_CASE("links are followed and stay links", "[output]") {
  const test::TemporaryDirectory directory;
  fs::create_directories(directory / "there");
  write_whole_file(directory / "there/target", "old");
  fs::create_symlink("there/target", directory / "link");
  fs::create_symlink(directory / "link", directory / "second");
  write_whole_file(directory / "second", "new");
  CHECK(fs::is_symlink(directory / "link"));
  CHECK(fs::is_symlink(directory / "second"));
  CHECK(read_whole_file(directory / "there/target") == "new");

  fs::create_symlink("there/made", directory / "to-nothing");
  write_whole_file(directory / "to-nothing", "made");
  CHECK(read_whole_file(directory / "there/made") == "made");
  fs::create_symlink("circle", directory / "circle");
  CHECK_THROWS_AS(write_whole_file(directory / "circle", "x"), DataError);

  // A log takes the place of nothing but a log or an empty file.
  CHECK_THROWS_WITH(test::write_log(directory / "link", {{0, 0, "C", {1}}}),
                    Catch::Matchers::Contains("link: is there already and is no LCM log"));
  CHECK(read_whole_file(directory / "there/target") == "new");
  write_whole_file(directory / "link", "");
  test::write_log(directory / "link", {{0, 0, "C", {1}}});
  test::write_log(directory / "link", {{0, 0, "C", {1}}});
  CHECK(fs::is_symlink(directory / "link"));
  CHECK(fs::file_size(directory / "there/target") == 30);
  CHECK(is_same_file(directory / "link", directory / "there/target"));
  CHECK_FALSE(is_same_file(directory / "link", directory / "none"));
}

TEST_CASE("devices and pipes are written, not replaced", "[output]") {
  write_whole_file("/dev/null", "nothing");
  CHECK(fs::is_character_file("/dev/null"));

  const test::TemporaryDirectory directory;
  const fs::path pipe = directory / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  fs::create_symlink("pipe", directory / "link");
  write_whole_file(directory / "link", "through");
  std::array<char, 16> bytes{};
  CHECK(::read(reader, bytes.data(), bytes.size()) == 7);
  CHECK(std::string(bytes.data()) == "through");
  ::close(reader);
  CHECK(fs::is_fifo(pipe));
  CHECK(fs::is_symlink(directory / "link"));
  CHECK(is_special(directory / "link"));
}
