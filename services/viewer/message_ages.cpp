#include "services/viewer/message_ages.hpp"

namespace understory::viewer {
namespace {

constexpr std::int64_t kAgePeriod_us = 10'000'000;

}  // namespace

void MessageAges::note_stamp(model::Utime utime, std::int64_t wall_us) {
  note(utime, wall_us);
  if (wall_us - period_us_ > kAgePeriod_us) {
    least_us_ = {std::nullopt, least_us_[0]};
    period_us_ = wall_us;
  }
  const std::int64_t age_us = wall_us - utime;
  if (!least_us_[0] || age_us < *least_us_[0]) least_us_[0] = age_us;
}

std::optional<double> MessageAges::age_ms(model::Utime utime, std::int64_t wall_us) const {
  std::optional<std::int64_t> least_us;
  for (const auto& one : least_us_) {
    if (one && (!least_us || *one < *least_us)) least_us = one;
  }
  if (!least_us) return std::nullopt;
  return 1e-3 * static_cast<double>(wall_us - utime - *least_us);
}

}  // namespace understory::viewer
