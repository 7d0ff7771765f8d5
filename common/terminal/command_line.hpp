// A program's command line: parsed, run, and its exit status.
#pragma once

namespace CLI {
class App;
}

namespace understory::terminal {

/// Runs the command that the arguments name. Exit status: 0 done, 1 the work failed, 2 wrong usage.
/// What is thrown ends in one line on stderr behind the program's name.
int run_command_line(CLI::App& app, int argc, char** argv);

}  // namespace understory::terminal
