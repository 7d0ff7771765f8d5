#include "eval/tools/parallel.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"

namespace understory::eval::tools {

void run_in_parallel(std::size_t count, int jobs, std::string_view what,
                     const std::atomic<bool>& stop, const std::function<void(std::size_t)>& job) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr failure;
  std::mutex mutex;
  terminal::Progress progress(std::string(what), static_cast<double>(count),
                              terminal::Progress::Without::kSeconds);

  const auto work = [&] {
    for (std::size_t i = next++; i < count && !stop && !failed; i = next++) {
      try {
        job(i);
        const std::scoped_lock lock(mutex);
        progress.advance();
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!failure) failure = std::current_exception();
        failed = true;
      }
    }
  };

  // The calling thread works too; the block ends when all threads have.
  {
    std::vector<std::jthread> workers;
    const auto extra = std::min(static_cast<std::size_t>(std::max(1, jobs)), count);
    for (std::size_t i = 1; i < extra; ++i) workers.emplace_back(work);
    work();
  }

  if (stop) throw terminal::Interrupted{};
  if (failure) std::rethrow_exception(failure);
}

}  // namespace understory::eval::tools
