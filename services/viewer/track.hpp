// A path that grows at its end and is sometimes told anew from somewhere on.
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
  std::uint8_t status = 0;  ///< As the page has them.
};

/// How far a reader of a Track has come.
struct TrackCursor {
  Change change = 0;
  std::size_t taken = 0;  ///< Points that it has, as they were at `change`.
};

/// At most kMostPoints: then every second point of it is left out, and it is told anew.
class Track {
 public:
  static constexpr std::size_t kMostRewrites = 1024;
  static constexpr std::size_t kMostPoints = std::size_t{1} << 20U;

  /// `changes` is the scene's counter and must outlive it.
  explicit Track(Change& changes) : changes_(&changes) {}

  /// Adds a point at the end.
  void append(const TrackPoint& point);
  /// Gives the last point a new value; there is one.
  void replace_last(const TrackPoint& point) { replace_from(points_.size() - 1, {&point, 1}); }
  /// Keeps the first `kept` points (at most those there are), and takes these behind them.
  void replace_from(std::size_t kept, std::span<const TrackPoint> points);
  /// Empty again.
  void clear() { replace_from(0, {}); }

  /// All points, in order of time.
  std::span<const TrackPoint> points() const { return points_; }
  /// The first point that a reader does not have as it is now; points().size() where it has all.
  std::size_t first_unread(const TrackCursor& cursor) const;
  /// Whether a reader lacks something: points, or that there are fewer of them.
  bool has_changed_since(const TrackCursor& cursor) const {
    return first_unread(cursor) < points_.size() || cursor.taken > points_.size();
  }
  /// Number of the latest change.
  Change change() const { return change_; }

 private:
  /// From `first` on it was told anew at `change`.
  struct Rewrite {
    Change change = 0;
    std::size_t first = 0;
  };

  Change* changes_;
  Change change_ = 0;
  std::vector<TrackPoint> points_;
  /// Both members ascending: one that reaches further back replaces those before it. The oldest two
  /// become one where there are too many: who has not read for so long gets more than it lacks.
  std::deque<Rewrite> rewrites_;
};

}  // namespace understory::viewer
