// A program's command line: parsed, run, and its exit status.
#pragma once

namespace CLI {
class App;
}

namespace understory::terminal {

/// Runs the command in the arguments. Exit status: 0 done, 1 the work failed, 2 wrong usage. An
/// exception is printed as one line on stderr after the program's name.
int run_command_line(CLI::App& app, int argc, char** argv);

}  // namespace understory::terminal
