// Runs the understory command as a user would.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/io/log_fixture.hpp"

namespace understory::test {

struct Outcome {
  int status = -1;
  std::string out;
  std::string error;
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// `arguments` as a shell line; ends in the directory's out and error files.
inline Outcome understory_command(const TemporaryDirectory& directory,
                                  const std::string& arguments) {
  const std::string line = std::string(UNDERSTORY_COMMAND) + " " + arguments + " > " +
                           (directory / "stdout").string() + " 2> " +
                           (directory / "stderr").string();
  const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(directory / "stdout"),
          read_text(directory / "stderr")};
}

inline std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace understory::test
