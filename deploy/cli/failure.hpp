// How a command ends when it cannot do its work.
#pragma once

#include <string>

namespace understory::cli {

/// Prints `what` as one line to stderr and ends the command with exit status 1.
[[noreturn]] void fail(const std::string& what);
/// The same for wrong usage: exit status 2.
[[noreturn]] void wrong_usage(const std::string& what);

}  // namespace understory::cli
