#include "services/viewer/track.hpp"

#include <algorithm>

namespace understory::viewer {

void Track::append(const TrackPoint& point) {
  if (points_.size() >= kMostPoints) {
    std::vector<TrackPoint> half;
    half.reserve(kMostPoints);
    for (std::size_t i = 0; i < points_.size(); i += 2) half.push_back(points_[i]);
    replace_from(0, half);
  }
  points_.push_back(point);
  change_ = ++*changes_;
}

void Track::replace_from(std::size_t kept, std::span<const TrackPoint> points) {
  kept = std::min(kept, points_.size());
  change_ = ++*changes_;
  points_.resize(kept);
  points_.insert(points_.end(), points.begin(), points.end());
  while (!rewrites_.empty() && rewrites_.back().first >= kept) rewrites_.pop_back();
  rewrites_.push_back({change_, kept});
  if (rewrites_.size() <= kMostRewrites) return;
  rewrites_[1].first = rewrites_[0].first;
  rewrites_.pop_front();
}

std::size_t Track::first_unread(const TrackCursor& cursor) const {
  std::size_t first = std::min(cursor.taken, points_.size());
  // The rewrites after the cursor; the first of them begins at the earliest point.
  const auto later = std::ranges::upper_bound(rewrites_, cursor.change, {}, &Rewrite::change);
  if (later != rewrites_.end()) first = std::min(first, later->first);
  return first;
}

}  // namespace understory::viewer
