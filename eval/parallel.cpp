#include "eval/parallel.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "eval/progress.hpp"
#include "eval/run.hpp"

namespace understory::eval {

void run_in_parallel(std::size_t count, int jobs, std::string_view what,
                     const std::atomic<bool>& stop, const std::function<void(std::size_t)>& job) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr failure;
  std::mutex mutex;
  Progress progress(what, count);
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
  {
    std::vector<std::jthread> workers;
    const auto extra = std::min(static_cast<std::size_t>(std::max(1, jobs)), count);
    for (std::size_t i = 1; i < extra; ++i) workers.emplace_back(work);
    work();
  }
  if (stop) throw Interrupted{};
  if (failure) std::rethrow_exception(failure);
}

}  // namespace understory::eval
