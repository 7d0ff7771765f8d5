#include "common/web/shared_state.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <utility>

namespace understory::web {

SharedState::SharedState() : event_file_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (event_file_ < 0) throw ServerError("web server: no event file");
}

SharedState::~SharedState() { ::close(event_file_); }

void SharedState::push(Event event) {
  {
    const std::scoped_lock lock(mutex_);
    events_.push_back(std::move(event));
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(event_file_, &one, sizeof(one));
}

std::vector<Event> SharedState::take() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto taken = ::read(event_file_, &count, sizeof(count));
  const std::scoped_lock lock(mutex_);
  return std::exchange(events_, {});
}

void SharedState::set_document(const std::string& path, Document document) {
  auto shared = std::make_shared<const Document>(std::move(document));
  const std::scoped_lock lock(mutex_);
  documents_[path] = std::move(shared);
}

std::shared_ptr<const Document> SharedState::document(const std::string& path) const {
  const std::scoped_lock lock(mutex_);
  const auto found = documents_.find(path);
  return found == documents_.end() ? nullptr : found->second;
}

void SharedState::count(std::uint64_t ServerCounts::*which) {
  const std::scoped_lock lock(mutex_);
  ++(counts_.*which);
}

ServerCounts SharedState::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

}  // namespace understory::web
