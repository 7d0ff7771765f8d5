#include <fmt/format.h>

#include <numbers>

#include "common/story/tell.hpp"
#include "common/story/words.hpp"

namespace understory::story {
namespace {

/// Collects steps; a step on the way gets the time since the previous one.
class WayToPose {
 public:
  WayToPose(const PoseBook& book, const PoseRecord& pose)
      : book_(book), pose_(pose), knows_times_(!book.is_replayed()) {}

  std::vector<StoryStep> steps() {
    lasers();
    scan();
    beside();
    decision();
    on_the_way("SLAM_POSE", fmt::format("number {}", pose_.pose.sequence), pose_.arrival);
    return std::move(steps_);
  }

 private:
  void on_the_way(std::string name, std::string text, const Arrival& arrival) {
    std::optional<double> ms;
    const std::int64_t now_us = arrival.received_us;
    if (knows_times_ && now_us != 0) {
      if (last_received_us_) {
        ms = milliseconds(*last_received_us_, now_us);
      } else if (is_same_clock(pose_.pose.utime, now_us)) {
        ms = milliseconds(pose_.pose.utime, now_us);
      }
      last_received_us_ = now_us;
    }
    steps_.push_back({std::move(name), std::move(text), ms});
  }
  void aside(std::string name, std::string text) {
    steps_.push_back({std::move(name), std::move(text), std::nullopt});
  }
  /// Whether it arrived before the pose.
  bool before(const Arrival& arrival) const { return arrival.order < pose_.arrival.order; }
  /// The reason why a message is missing.
  template <class T>
  static std::string missing(const History<T>& channel, std::string_view which) {
    if (channel.heard() == 0) return "not among the messages: this channel was not recorded";
    if (channel.dropped() == 0) return fmt::format("none {}, though others came", which);
    return fmt::format("none {}; {}", which, dropped_words("ones", channel.dropped()));
  }

  /// Adds raw and processed laser data, planar or in parts.
  void lasers() {
    using enum PoseBook::Laser;
    const bool has_plane = book_.laser(kRawScan).heard() + book_.laser(kScan).heard() > 0;
    const bool has_sweep = book_.laser(kRawSweep).heard() + book_.laser(kSweep).heard() > 0;
    if (!has_plane && !has_sweep) {
      return aside("LIDAR_SCAN, LIDAR_SWEEP",
                   "not among the messages: LANDMARKS came without a laser, or its channels were "
                   "not recorded");
    }
    const bool in_plane = has_plane && (!has_sweep || at_stamp(book_.laser(kScan)) != nullptr);
    raw_laser(in_plane);
    laser(in_plane ? kScan : kSweep, in_plane ? "LIDAR_SCAN" : "LIDAR_SWEEP",
          at_stamp(book_.laser(in_plane ? kScan : kSweep)));
  }
  const LaserRecord* at_stamp(const History<LaserRecord>& channel) const {
    return channel.newest([&](const LaserRecord& one) {
      return one.utime == pose_.pose.utime && before(one.arrival);
    });
  }
  /// A sweep's stamp is its end, a raw sweep's stamp its begin: the revolution connects them. A
  /// de-skewed planar scan is a sweep too.
  void raw_laser(bool in_plane) {
    using enum PoseBook::Laser;
    const bool is_scan =
        in_plane || (book_.laser(kRawSweep).heard() == 0 && book_.laser(kRawScan).heard() > 0);
    const auto& raw = book_.laser(is_scan ? kRawScan : kRawSweep);
    const LaserRecord* found = at_stamp(raw);
    if (!in_plane) {
      const LaserRecord* const sweep = at_stamp(book_.laser(kSweep));
      found = sweep == nullptr ? nullptr : raw.newest([&](const LaserRecord& one) {
        return one.revolution == sweep->revolution && before(one.arrival) &&
               one.utime <= pose_.pose.utime;
      });
    }
    laser(is_scan ? kRawScan : kRawSweep, is_scan ? "RAW_SCAN" : "RAW_SWEEP", found);
  }
  void laser(PoseBook::Laser channel, const char* name, const LaserRecord* found) {
    if (found == nullptr) return aside(name, missing(book_.laser(channel), "of this revolution"));
    std::string text = counted(found->points, found->parts > 1 ? "point" : "return");
    if (found->parts > 1) {
      text += fmt::format(" in {} of {}", found->parts_heard, counted(found->parts, "part"));
      if (knows_times_) {
        text += fmt::format(", the first {:.1f} ms before the last",
                            milliseconds(found->first_received_us, found->arrival.received_us));
      }
    }
    on_the_way(name, text, found->arrival);
  }

  void scan() {
    const ScanRecord* const found = book_.scan_of(pose_);
    if (found == nullptr) return aside("LANDMARKS", missing(book_.scans(), "of this stamp"));
    on_the_way(
        "LANDMARKS",
        fmt::format("number {}: {}", found->sequence, counted(found->landmarks, "detection")),
        found->arrival);
  }

  /// Adds other messages available when the pose was made.
  void beside() {
    motion();
    const ScanRecord* const tracked = book_.tracked().newest([&](const ScanRecord& one) {
      return one.utime <= pose_.pose.utime && before(one.arrival);
    });
    if (tracked != nullptr) {
      aside("TRACKED_LANDMARKS", fmt::format("{}, {:.1f} ms older; to the filter",
                                             counted(tracked->landmarks, "landmark"),
                                             milliseconds(tracked->utime, pose_.pose.utime)));
    } else {
      aside("TRACKED_LANDMARKS", missing(book_.tracked(), "before the pose"));
    }

    const FilterRecord* const filter = book_.filter_poses().newest([&](const FilterRecord& one) {
      return one.utime <= pose_.pose.utime && before(one.arrival);
    });
    if (filter == nullptr)
      return aside("EKF_POSE", missing(book_.filter_poses(), "before the pose"));
    aside("EKF_POSE",
          fmt::format("a gate only: {:.1f} ms older, sigma {:.3f} m, {} used and {} refused by it",
                      milliseconds(filter->utime, pose_.pose.utime), filter->sigma_m,
                      counted(filter->landmarks_used, "landmark"), filter->landmarks_refused));
  }
  void motion() {
    if (book_.motions().heard() == 0)
      return aside("ODOMETRY", missing(book_.motions(), "before the pose"));
    const PoseRecord* const previous = book_.poses().newest(
        [&](const PoseRecord& one) { return one.arrival.order < pose_.arrival.order; });
    const model::Utime from = previous == nullptr ? 0 : previous->pose.utime;

    std::size_t count = 0;
    bool has_wheels = false;
    bool has_inertial = false;
    geometry::SE2 sum;
    for (const MotionRecord& one : book_.motions()) {
      if (one.utime <= from || one.utime > pose_.pose.utime || !before(one.arrival)) continue;
      ++count;
      has_wheels |= one.has_wheels;
      has_inertial |= one.has_inertial;
      sum = sum * one.from_T_to;
    }

    if (count == 0) return aside("ODOMETRY", "none since the pose before");
    aside("ODOMETRY", fmt::format("{} since the pose before: {:.3f} m, {:.2f} deg, from {}",
                                  counted(count, "increment"), sum.translation().norm(),
                                  sum.theta() * 180.0 / std::numbers::pi,
                                  has_wheels && has_inertial ? "wheels and IMU"
                                  : has_wheels               ? "wheels"
                                  : has_inertial             ? "IMU"
                                                             : "its source alone"));
  }

  /// The keyframe that determined the pose, or the last one before a pose between keyframes.
  void decision() {
    const auto number = pose_.pose.keyframe_sequence;
    const UpdateRecord* const update = book_.updates().newest([&](const UpdateRecord& one) {
      return before(one.arrival) && (!number || one.keyframe == *number);
    });
    const bool is_named = number || update != nullptr;
    const std::uint64_t which = number ? *number : is_named ? update->keyframe : 0;
    const KeyframeRecord* const keyframe = book_.keyframes().newest([&](const KeyframeRecord& one) {
      return before(one.arrival) && is_named && one.keyframe == which;
    });

    const std::string wanted = is_named ? fmt::format("of number {}", which) : "before the pose";
    step("KEYFRAME", keyframe == nullptr ? missing(book_.keyframes(), wanted) : words(*keyframe),
         keyframe == nullptr ? nullptr : &keyframe->arrival, number.has_value());
    step("SLAM_UPDATE", update == nullptr ? missing(book_.updates(), wanted) : words(*update),
         update == nullptr ? nullptr : &update->arrival, number.has_value());
  }
  /// Adds a step: on the way if the pose is derived from it, else beside it.
  void step(const char* name, std::string text, const Arrival* arrival, bool is_on_the_way) {
    if (arrival != nullptr && is_on_the_way) return on_the_way(name, std::move(text), *arrival);
    aside(name, std::move(text));
  }
  std::string words(const KeyframeRecord& keyframe) const {
    std::string text =
        fmt::format("number {}: {} of {}", keyframe.keyframe,
                    counted(keyframe.landmarks, "landmark"), counted(keyframe.members, "scan"));
    if (!keyframe.scans.empty()) {
      text += fmt::format(", stamps {} to {}", keyframe.scans.front(), keyframe.scans.back());
    }
    return text + (pose_.pose.keyframe_sequence ? "" : "; the latest in the map");
  }
  static std::string words(const UpdateRecord& update) {
    std::string text =
        fmt::format("{}: {}", status_words(update.status), counted(update.inliers, "inlier"));
    if (update.degrees_of_freedom > 0) {
      text += fmt::format(", chi2 {:.1f} of {}", update.chi2, update.degrees_of_freedom);
    }
    if (update.used_prior) text += ", in gates around the predicted pose";
    if (!update.used_prior && update.candidates > 0) {
      text += fmt::format(", by search ({}), 10^{:.1f} false alarms",
                          counted(update.candidates, "candidate"), update.log10_false_alarm);
    }
    text += fmt::format("; {} added, {} merged, {} removed, {} expected and not seen", update.added,
                        update.merged, update.removed, update.expected);
    return text + (update.reason.empty() ? "" : "; " + update.reason);
  }

  const PoseBook& book_;
  const PoseRecord& pose_;
  bool knows_times_;
  std::optional<std::int64_t> last_received_us_;
  std::vector<StoryStep> steps_;
};

}  // namespace

std::vector<StoryStep> steps_to(const PoseBook& book, const PoseRecord& pose) {
  return WayToPose(book, pose).steps();
}

}  // namespace understory::story
