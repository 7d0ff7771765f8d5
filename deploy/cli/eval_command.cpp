// `understory eval`: the experiments, a separate program that a vehicle does not need.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/paths.hpp"

namespace understory::cli {
namespace {

/// Replaces this process by `understory-eval` with these arguments; returns only by an exception.
[[noreturn]] void become_eval(std::vector<std::string> words) {
  words.insert(words.begin(), find_executable("understory-eval"));
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  ::execvp(argv.front(), argv.data());
  fail(
      fmt::format("eval: {}: {}; the experiments are a program of their own: install the package "
                  "understory-eval, or build it (ninja -C build/release understory-eval)",
                  words.front(), std::strerror(errno)));
}

}  // namespace

void add_eval_command(CLI::App& parent) {
  auto* command = parent.add_subcommand(
      "eval", "Experiments: tables beside published figures, JSON, plots (understory-eval)");
  command->set_help_flag();  // understory-eval has its own help.
  command->prefix_command();
  command->callback([command] { become_eval(command->remaining()); });
}

}  // namespace understory::cli
