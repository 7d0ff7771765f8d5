#include "services/loop_closer/sent_closures.hpp"

#include <algorithm>
#include <cmath>

namespace understory::loop_closer {

void SentClosures::add(std::uint64_t id, const ClosurePaths& paths) {
  sent_.push_back({id, paths});
  if (sent_.size() > kMost) sent_.pop_front();
}

bool SentClosures::note(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  const auto sent = std::ranges::find(sent_, result.closure_id, &Sent::id);
  if (sent == sent_.end()) return false;
  if (result.status == kAccepted) accepted_at_m_ = std::max(accepted_at_m_, sent->paths.to_m);
  if (result.status == kRevoked) {
    revoked_.push_back(sent->paths);
    if (revoked_.size() > kMost) revoked_.pop_front();
  }
  return true;
}

bool SentClosures::was_revoked(const ClosurePaths& paths) const {
  return std::ranges::any_of(revoked_, [&](const ClosurePaths& one) {
    return std::abs(one.from_m - paths.from_m) < kRevokedM &&
           std::abs(one.to_m - paths.to_m) < kRevokedM;
  });
}

}  // namespace understory::loop_closer
