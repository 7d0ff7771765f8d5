#include "deploy/cli/failure.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <system_error>

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

void refuse_to_overwrite(const std::filesystem::path& in, const std::filesystem::path& out) {
  std::error_code ignored;
  if (std::filesystem::equivalent(in, out, ignored))
    wrong_usage(fmt::format("--out: {} is the input itself", out.string()));
}

}  // namespace understory::cli
