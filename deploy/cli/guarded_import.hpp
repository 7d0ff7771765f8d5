// How an import ends that finds something wrong.
#pragma once

#include <functional>

namespace understory::cli {

/// Runs an import; what is wrong with the data or the log ends the command in one line, and so does
/// Ctrl-C.
void guarded_import(const std::function<void()>& import);

}  // namespace understory::cli
