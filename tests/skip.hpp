// A test case that cannot run on this machine is reported as "skipped".
#pragma once

#include <string>

namespace understory::test {

/// Ends the running test case: it is neither passed nor failed. `reason` (what is missing, one
/// line) is printed with the case's name after the summary. A program of which all cases were
/// skipped ends with exit status 4; CTest then reports "Skipped". Catch2 has this from version 3.3
/// on.
[[noreturn]] void skip(const std::string& reason);

}  // namespace understory::test
