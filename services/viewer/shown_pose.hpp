// The newest pose, the path so far, and what a driver must know of them.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/model/slam_output.hpp"
#include "services/viewer/part.hpp"
#include "services/viewer/scene_numbers.hpp"
#include "services/viewer/track.hpp"

namespace understory::viewer {

/// What a driver must know of the pose.
struct Verdict {
  /// The worse the later, but for kWaiting.
  enum class State : std::uint8_t { kWaiting, kOk, kUnsure, kLost, kSilent };
  State state = State::kWaiting;
  std::string text = "no pose yet";
  std::int64_t since_utime = 0;  ///< [us] since when it is so.
};

/// As pages and scripts have it: waiting, ok, unsure, lost, silent.
const char* state_name(Verdict::State state);

/// Whether a pose says where the vehicle is, be it by odometry alone.
bool has_place(const model::SlamPose& pose);

/// Draws the path and judges the pose.
class ShownPose {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownPose(Change& changes) : changes_(&changes), driven_(changes) {
    verdict_.changed(changes) = {};
  }

  /// The next pose and when it came [us].
  void take(const model::SlamPose& pose, std::int64_t wall_us);
  /// The verdict on that pose, beside its figures.
  void judge(const SceneNumbers& numbers);
  /// How often poses come; none before two have come at different times.
  std::optional<double> rate_hz() const;
  /// Whether poses that came at this rate (none = unknown) have ended. The verdict is silent then,
  /// since `utime`.
  bool falls_silent(std::int64_t wall_us, std::optional<double> rate_hz, model::Utime utime);
  /// Another map has another frame.
  void start_map() { driven_.clear(); }
  /// No pose has come.
  void clear();

  /// The newest pose.
  const Part<std::optional<model::SlamPose>>& pose() const { return pose_; }
  /// What is said of it.
  const Part<Verdict>& verdict() const { return verdict_; }
  /// The path by poses as they came.
  const Track& driven() const { return driven_; }

 private:
  void draw(const model::SlamPose& pose);
  void set_verdict(Verdict::State state, std::string text, model::Utime utime);

  Change* changes_;
  Part<std::optional<model::SlamPose>> pose_;
  Part<Verdict> verdict_;
  Track driven_;
  std::int64_t wall_us_ = 0;
  std::deque<std::int64_t> times_us_;
};

}  // namespace understory::viewer
