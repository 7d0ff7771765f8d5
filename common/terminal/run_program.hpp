// Runs another program to its end.
#pragma once

#include <string>
#include <vector>

namespace understory::terminal {

/// Runs a program with its arguments, on this terminal, and waits. `words`: path, then arguments.
/// Returns its exit status; -1 where it could not be started or a signal ended it.
int run_program(std::vector<std::string> words);

}  // namespace understory::terminal
