// Reads through a window, also where the disk fails in between.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>

#include "common/io/file_window.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"

using namespace understory;

namespace {

/// Gives the descriptor another file.
void replace(int descriptor, const std::filesystem::path& path) {
  const int other = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  REQUIRE(other >= 0);
  REQUIRE(::dup2(other, descriptor) == descriptor);
  ::close(other);
}

}  // namespace

TEST_CASE("after a read that failed the window holds nothing of before", "[io]") {
  test::TemporaryDirectory directory;
  const auto path = directory / "bytes";
  test::Bytes bytes(3 * io::FileWindow::kWindowBytes);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  bytes[2 * io::FileWindow::kWindowBytes + 5] = 77;
  test::write_bytes(path, bytes);

  const int next = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::close(next);
  io::FileWindow window(path);  // Has the descriptor that is free now.
  CHECK(window.size() == bytes.size());
  CHECK(window.peek(3, 4)[1] == 4);
  CHECK(window.peek(bytes.size() - 2, 100).size() == 2);
  CHECK(window.peek(bytes.size(), 1).empty());

  const std::uint64_t far = 2 * io::FileWindow::kWindowBytes + 5;
  CHECK(window.peek(3, 4)[1] == 4);
  replace(next, directory.path());
  CHECK_THROWS_AS(window.peek(far, 1), std::runtime_error);
  replace(next, path);
  REQUIRE(window.peek(far, 1).size() == 1);
  CHECK(window.peek(far, 1)[0] == 77);
}
