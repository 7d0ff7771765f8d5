#include "common/bus/state_keeper.hpp"

#include <exception>

namespace understory::bus {

std::optional<wire::Refusal> StateKeeper::append(std::string_view channel,
                                                 std::span<const std::uint8_t> bytes) {
  if (store_ == nullptr) return std::nullopt;
  ++events_;
  if (store_->needs_snapshot()) return std::nullopt;
  const auto refusal = store_->append(channel, bytes);
  if (refusal) is_failing_ = true;
  return refusal;
}

bool StateKeeper::is_due(std::int64_t now) {
  if (store_ == nullptr || events_ == 0) return false;
  if (period_start_ < 0 || period_start_ > now) period_start_ = now;

  // After a failure (e.g. a full disk) it is tried again once a second, not at every event.
  constexpr std::int64_t kRetryUs = 1000000;
  const bool has_waited = tried_utime_ < 0 || now - tried_utime_ >= kRetryUs;
  const bool is_due =
      events_ >= every_events_ || now - period_start_ >= every_us_ || store_->needs_snapshot();
  return is_due && has_waited;
}

std::optional<wire::Refusal> StateKeeper::save(std::int64_t now,
                                               const std::function<std::string()>& make_state) {
  if (store_ == nullptr || now < 0) return std::nullopt;
  tried_utime_ = now;
  is_failing_ = true;
  try {
    if (auto refusal = store_->save(make_state())) return refusal;
  } catch (const std::exception& error) {
    return wire::Refusal{wire::Reason::kStateNotKept, error.what()};
  }

  resume(now);
  events_ = 0;
  is_failing_ = false;
  return std::nullopt;
}

std::int64_t StateKeeper::journal_bytes() const {
  return store_ == nullptr ? 0 : static_cast<std::int64_t>(store_->journal_bytes());
}

}  // namespace understory::bus
