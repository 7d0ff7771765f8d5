// Whether the mapper knows already that the vehicle was here before.
#pragma once

#include <algorithm>
#include <deque>

#include "common/model/archive.hpp"
#include "common/model/map.hpp"

namespace understory::loop_closer {

/// Ids of landmarks grow in the order in which the mapper found them: an id that there was a good
/// way back is of a landmark of an earlier pass.
class KnownGround {
 public:
  /// Landmarks are of an earlier pass that were there `back_m` ago [m of path].
  explicit KnownGround(double back_m) : back_m_(back_m) {}

  /// Forgets everything: another map.
  void restart() { *this = KnownGround(back_m_); }
  /// A keyframe that the mapper placed, at this path [m].
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
    all_ = update.associations.size();
    old_ = static_cast<std::size_t>(std::ranges::count_if(update.associations, is_old));
  }
  /// Whether at least this share of the last keyframe's landmarks is of earlier passes, and three.
  bool is_known(double share) const {
    return old_ >= 3 && static_cast<double>(old_) >= share * static_cast<double>(all_);
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.newest_, self.all_, self.old_);
  }

 private:
  static constexpr double kStepM = 2.0;  ///< Who stands still needs no memory.
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
  std::size_t all_ = 0;
  std::size_t old_ = 0;
};

}  // namespace understory::loop_closer
