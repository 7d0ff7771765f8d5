#include "deploy/cli/failure.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/terminal/printable.hpp"

namespace understory::cli {

void fail(const std::string& what) {
  fmt::print(stderr, "understory: {}\n", terminal::printable_lines(what));
  throw CLI::RuntimeError(1);
}

void wrong_usage(const std::string& what) {
  fmt::print(stderr, "understory: {}\n", terminal::printable_lines(what));
  throw CLI::RuntimeError(2);
}

}  // namespace understory::cli
