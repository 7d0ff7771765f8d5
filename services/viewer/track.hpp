// A path that grows at its end and is sometimes replaced from some point on.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "services/viewer/landmark_table.hpp"

namespace understory::viewer {

/// One pose of a path.
struct TrackPoint {
  std::int64_t utime = 0;  ///< [us]
  float x_m = 0.0F;
  float y_m = 0.0F;
  float theta_rad = 0.0F;
  float sigma_m = 0.0F;     ///< Largest standard deviation of the position; 0 = unknown.
  std::uint8_t status = 0;  ///< Number used by the page.
};

/// Position of a reader in a Track.
struct TrackCursor {
  Change change = 0;
  std::size_t taken = 0;  ///< Number of points that it has, in their state at `change`.
};

/// At most kMostPoints: beyond that every second point is removed, and the path is sent again.
class Track {
 public:
  static constexpr std::size_t kMostRewrites = 1024;
  static constexpr std::size_t kMostPoints = std::size_t{1} << 20U;

  /// `changes` is the scene's counter and must outlive it.
  explicit Track(Change& changes) : changes_(&changes) {}

  /// Adds a point at the end.
  void append(const TrackPoint& point);
  /// Replaces the last point, which must exist.
  void replace_last(const TrackPoint& point) { replace_from(points_.size() - 1, {&point, 1}); }
  /// Keeps the first `kept` points (at most the existing ones), and appends these.
  void replace_from(std::size_t kept, std::span<const TrackPoint> points);
  /// Removes all points.
  void clear() { replace_from(0, {}); }

  /// All points, in order of time.
  std::span<const TrackPoint> points() const { return points_; }
  /// The first point that a reader lacks in its present state; points().size() if there is none.
  std::size_t first_unread(const TrackCursor& cursor) const;
  /// Whether a reader lacks a change: points, or their removal.
  bool has_changed_since(const TrackCursor& cursor) const {
    return first_unread(cursor) < points_.size() || cursor.taken > points_.size();
  }
  /// Number of the latest change.
  Change change() const { return change_; }

 private:
  /// The path from `first` on was replaced at `change`.
  struct Rewrite {
    Change change = 0;
    std::size_t first = 0;
  };

  Change* changes_;
  Change change_ = 0;
  std::vector<TrackPoint> points_;
  /// Both members ascending: a rewrite from an earlier point replaces those before it. Beyond the
  /// limit the oldest two are merged: a reader that is far behind gets more points than it lacks.
  std::deque<Rewrite> rewrites_;
};

}  // namespace understory::viewer
