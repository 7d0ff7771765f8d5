// Independent jobs side by side, with progress on the terminal.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string_view>

namespace understory::eval::tools {

/// Calls job(0 .. count-1), `jobs` at a time, each once; a bar on stderr shows how many are done
/// and an estimate of the time left. An exception of a job ends all: it is thrown again here, the
/// first in time. When `stop` turns true no further job starts and terminal::Interrupted is
/// thrown.
void run_in_parallel(std::size_t count, int jobs, std::string_view what,
                     const std::atomic<bool>& stop, const std::function<void(std::size_t)>& job);

}  // namespace understory::eval::tools
