#include "services/viewer/shown_closures.hpp"

namespace understory::viewer {
namespace {

constexpr std::size_t kMostClosures = 20'000;

const char* result_text(model::LoopResult::Status status) {
  switch (status) {
    case model::LoopResult::Status::kAccepted:
      return "accepted";
    case model::LoopResult::Status::kWaiting:
      return "waiting";
    case model::LoopResult::Status::kRefused:
      return "refused";
    case model::LoopResult::Status::kRevoked:
      return "revoked";
  }
  return "sent";
}

}  // namespace

void ShownClosures::take(const model::LoopClosure& closure) {
  if (!closures_.contains(closure.id) && closures_.size() >= kMostClosures)
    closures_.erase(closures_.begin());
  SceneClosure& one = closures_[closure.id];
  if (closure.is_revoked) {
    one.closure.id = closure.id;
    one.status = "revoked";
  } else {
    one.closure = closure;
  }
  change_ = ++*changes_;
}

void ShownClosures::take(const model::LoopResult& result) {
  const auto found = closures_.find(result.closure_id);
  if (found == closures_.end()) return;
  found->second.status = result_text(result.status);
  found->second.reason = result.reason;
  change_ = ++*changes_;
}

void ShownClosures::clear() {
  closures_.clear();
  change_ = ++*changes_;
}

}  // namespace understory::viewer
