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
  if (store_ == nullptr || events_ == 0 || store_->is_saving()) return false;
  if (period_start_ < 0 || period_start_ > now) period_start_ = now;

  // After a failure (e.g. a full disk) the save is repeated once a second, not at every event.
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
  saved_events_ = events_;
  try {
    if (auto refusal = store_->save(make_state())) {
      is_failing_ = true;
      return refusal;
    }
  } catch (const std::exception& error) {
    is_failing_ = true;
    return wire::Refusal{wire::Reason::kStateNotKept, error.what()};
  }

  if (!store_->is_saving()) kept();
  return std::nullopt;
}

std::optional<StateStore::Kept> StateKeeper::settle() {
  if (store_ == nullptr) return std::nullopt;
  auto end = store_->finished();
  if (!end) return std::nullopt;
  if (*end) {
    is_failing_ = true;
  } else {
    kept();
  }
  return end;
}

void StateKeeper::kept() {
  resume(tried_utime_);
  events_ -= saved_events_;
  is_failing_ = false;
}

std::int64_t StateKeeper::journal_bytes() const {
  return store_ == nullptr ? 0 : static_cast<std::int64_t>(store_->journal_bytes());
}

}  // namespace understory::bus
