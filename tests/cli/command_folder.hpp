// Commands that work in a folder of their own.
#pragma once

#include <string>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/map_file/map_fixture.hpp"

namespace understory::test {

/// A folder, and `understory` run in it.
struct CommandFolder {
  TemporaryDirectory directory;

  Outcome run(const std::string& arguments) const {
    return understory_command(directory, arguments);
  }
  /// What it prints where it ends well, as it must.
  std::string fine(const std::string& arguments) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    REQUIRE(outcome.status == 0);
    return outcome.out;
  }
  /// It must end with this status and say why in one line.
  void refused(const std::string& arguments, int status, const std::string& what) const {
    const Outcome outcome = run(arguments);
    CAPTURE(arguments, outcome.out, outcome.error);
    CHECK(outcome.status == status);
    CHECK(lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Catch::Matchers::Contains(what));
  }
};

}  // namespace understory::test
