// Whether the mapper already localises the vehicle on an earlier pass.
#pragma once

#include <algorithm>
#include <deque>
#include <utility>

#include "common/model/archive.hpp"
#include "common/model/map.hpp"

namespace understory::loop_closer {

/// Ids of landmarks grow in the order of their discovery: an id that existed `back_m` of path ago
/// belongs to a landmark of an earlier pass.
class KnownGround {
 public:
  /// `back_m`: path length after which a landmark belongs to an earlier pass [m].
  explicit KnownGround(double back_m) : back_m_(back_m) {}

  /// Clears everything, for another map.
  void restart() { *this = KnownGround(back_m_); }
  /// Adds a localised keyframe, at this path length [m].
  void add(const model::MapUpdate& update, double along_m) {
    if (newest_.empty() || along_m >= newest_.back().along_m + kStepM)
      newest_.push_back({along_m, newest_.empty() ? 0 : newest_.back().newest});
    for (const model::Association& pair : update.associations)
      newest_.back().newest = std::max(newest_.back().newest, pair.landmark_id);
    while (newest_.size() > 1 && newest_[1].along_m <= along_m - back_m_) newest_.pop_front();

    const bool is_back = newest_.front().along_m <= along_m - back_m_;
    const auto is_old = [&](const model::Association& pair) {
      return is_back && pair.landmark_id <= newest_.front().newest;
    };
    const auto old = std::ranges::count_if(update.associations, is_old);
    counts_.emplace_back(update.associations.size(), static_cast<std::size_t>(old));
    if (counts_.size() > kKeyframes) counts_.pop_front();
  }
  /// Whether at least this share of the landmarks of the last keyframes, and at least three, are of
  /// earlier passes.
  bool is_known(double share) const {
    std::size_t all = 0;
    std::size_t old = 0;
    for (const auto& [all_of_one, old_of_one] : counts_) {
      all += all_of_one;
      old += old_of_one;
    }
    return old >= 3 && static_cast<double>(old) >= share * static_cast<double>(all);
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.newest_, self.counts_);
  }

 private:
  static constexpr double kStepM = 2.0;  ///< Memory does not grow while the vehicle stands.
  static constexpr std::size_t kKeyframes = 5;
  struct Newest {
    double along_m = 0.0;
    model::LandmarkId newest = 0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.along_m, s.newest);
    }
  };
  double back_m_;
  std::deque<Newest> newest_;
  std::deque<std::pair<std::size_t, std::size_t>> counts_;  ///< All, old; of the last keyframes.
};

}  // namespace understory::loop_closer
