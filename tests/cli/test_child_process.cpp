// Starting programs from a process that lacks what others have.
#include <poll.h>
#include <unistd.h>

#include <system_error>

#include "deploy/launch/child_process.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

/// How a program ended, waited for.
launch::Ending ending_of(const launch::ChildProcess& process) {
  pollfd file{process.descriptor(), POLLIN, 0};
  REQUIRE(::poll(&file, 1, 60'000) == 1);
  const auto ending = process.ended();
  REQUIRE(ending);
  return *ending;
}

}  // namespace

TEST_CASE("A process without standard input starts others", "[cli]") {
  const int standard_input = ::dup(STDIN_FILENO);
  ::close(STDIN_FILENO);
  {
    // The handle is descriptor 0: the first one that is free.
    const auto process = launch::ChildProcess::start({"sh", {"-c", "exit 7"}, {}});
    CHECK(process.descriptor() == STDIN_FILENO);
    CHECK(ending_of(process).exit_code == 7);
  }
  if (standard_input >= 0) {
    ::dup2(standard_input, STDIN_FILENO);
    ::close(standard_input);
  }
}

TEST_CASE("What cannot be started is named, and leaves no descriptor open", "[cli]") {
  const int before = ::dup(STDERR_FILENO);
  ::close(before);
  for (int i = 0; i < 3; ++i)
    CHECK_THROWS_AS(launch::ChildProcess::start({"/no/such/program", {}, {}}), std::system_error);
  const int after = ::dup(STDERR_FILENO);
  ::close(after);
  CHECK(after == before);
}
