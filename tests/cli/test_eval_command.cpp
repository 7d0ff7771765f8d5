// `understory eval`: the experiments of the program beside it, or an error that says where it is.
#include <sys/wait.h>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

struct Outside {
  test::TemporaryDirectory directory;
  std::filesystem::path alone = directory / "alone";
  std::filesystem::path elsewhere = directory / "elsewhere";

  Outside() {
    std::filesystem::create_directories(alone);
    std::filesystem::create_directories(elsewhere);
    std::filesystem::copy(UNDERSTORY_COMMAND, alone / "understory");
  }
  /// The command where `understory-eval` is not beside it.
  Outcome run(const std::string& arguments) const {
    const std::string line = "PATH=" + elsewhere.string() + " " + (alone / "understory").string() +
                             " " + arguments + " > " + (directory / "stdout").string() + " 2> " +
                             (directory / "stderr").string();
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(directory / "stdout"),
            read_text(directory / "stderr")};
  }
};

}  // namespace

TEST_CASE("the experiments' help is that of their program", "[cli]") {
  const test::TemporaryDirectory directory;
  CHECK_THAT(understory_command(directory, "--help").out, Contains("  eval  "));
  const auto help = understory_command(directory, "eval --help");
  CHECK(help.status == 0);
  CHECK_THAT(help.out, Contains("Usage: understory-eval") && Contains("victoria-park"));
  const auto paths = understory_command(directory, "eval paths --help");
  CHECK(paths.status == 0);
  CHECK_THAT(paths.out, Contains("Usage: understory-eval paths"));
  CHECK(understory_command(directory, "eval").status == 2);
  CHECK(understory_command(directory, "eval paths --no-such-option").status == 2);
}

TEST_CASE_METHOD(Outside, "without understory-eval the error names the package", "[cli]") {
  const auto outcome = run("eval paths --runs 2");
  CHECK(outcome.status == 1);
  CHECK(lines(outcome.error) == 1);
  CHECK_THAT(outcome.error, Contains("understory-eval") && Contains("install the package") &&
                                Contains("ninja -C build/release understory-eval"));
}

TEST_CASE_METHOD(Outside, "understory-eval may be in PATH; it is given every word", "[cli]") {
  const auto program = elsewhere / "understory-eval";
  std::ofstream(program) << "#!/bin/sh\nfor word; do echo \"<$word>\"; done\nexit 7\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const auto outcome = run("eval log -h --runs=2 'a b' --seed 3 -j4 --version eval");
  CHECK(outcome.status == 7);
  CHECK(outcome.out ==
        "<log>\n<-h>\n<--runs=2>\n<a b>\n<--seed>\n<3>\n<-j4>\n<--version>\n<eval>\n");
}
