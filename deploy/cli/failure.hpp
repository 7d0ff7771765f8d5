// Ends a command that cannot do its work.
#pragma once

#include <filesystem>
#include <string>

namespace understory::cli {

/// Prints `what` as one line to stderr and ends the command with exit status 1.
[[noreturn]] void fail(const std::string& what);
/// The same for wrong usage: exit status 2.
[[noreturn]] void wrong_usage(const std::string& what);
/// Wrong usage where `out` is the file `in` itself, by any name or link: writing would destroy it.
void refuse_to_overwrite(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace understory::cli
