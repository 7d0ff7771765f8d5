// A point as plain numbers, and back. Part of point.hpp.
#pragma once

#include "common/existence/point.hpp"

namespace understory::existence {

template <Shell S>
SavedPoint<S> PointExistence<S>::save() const {
  SavedPoint<S> saved;
  static_assert(sizeof(saved) ==
                16 + sizeof(saved.pass) + sizeof(saved.numbers) + sizeof(saved.shell));
  saved.odds = odds_;
  saved.pass = {pass_ | (std::uint32_t{missed_share_.code()} << 16),
                marked_ | (std::uint32_t{last_hit_} << 24) | (std::uint32_t{flags_} << 29),
                missed_from_ | (std::uint32_t{occluder_.code()} << 24)};
  saved.numbers = {
      unseen_,
      chance_missed(),
      static_cast<float>(pending_seen_ + 65536U * (kWhole - until_missed_)),
      static_cast<float>(pending_missed_ + kMissedEnd * pending_hidden_ + 65536U * hidden_share_),
      evidence_.went,
      evidence_.since_s,
      decay_per_s(),
      gap_s_};
  shell_.store(saved.shell);
  return saved;
}

template <Shell S>
PointExistence<S> PointExistence<S>::load(const ExistenceModel& model, const SavedPoint<S>& saved) {
  PointExistence point(model, odds_of(model.parameters().prior));
  if (!saved.can_be() || !point.shell_.restore(saved.shell))
    throw std::invalid_argument("existence: a saved point that cannot be");
  point.odds_ = bounded(saved.odds);
  point.pass_ = static_cast<std::uint16_t>(saved.pass[0]);
  point.missed_share_ = saved.missed_share();
  point.occluder_ = saved.occluder();
  point.marked_ = saved.pass[1] & kSectors;
  point.last_hit_ = (saved.pass[1] >> 24U) & 31U;
  point.flags_ = (saved.pass[1] >> 29U) & 7U;
  point.missed_from_ = saved.pass[2] & kSectors;
  point.unseen_ = saved.numbers[0];
  point.keep_chance_missed(saved.numbers[1]);
  const std::uint32_t packed = saved.packed(2), missed = saved.packed(3);
  point.pending_seen_ = static_cast<std::uint16_t>(packed & 0xFFFFU);
  point.until_missed_ = kWhole - (packed >> 16U);
  point.pending_missed_ = saved.pending_missed(kMissedEnd) & (kMissedEnd - 1);
  point.pending_hidden_ = saved.pending_hidden(kMissedEnd) & (kHiddenEnd - 1);
  point.hidden_share_ = (missed >> 16U) & 0xFFU;
  point.evidence_ = {saved.numbers[4], saved.numbers[5]};
  point.keep_decay(saved.numbers[6]);
  point.gap_s_ = saved.numbers[7];
  return point;
}

}  // namespace understory::existence
