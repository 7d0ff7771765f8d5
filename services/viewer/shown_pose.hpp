// The newest pose, the path so far, and the verdict on the pose for the driver.
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

/// Quality of the pose, for the driver.
struct Verdict {
  /// In order of severity, except kWaiting.
  enum class State : std::uint8_t { kWaiting, kOk, kUnsure, kLost, kSilent };
  State state = State::kWaiting;
  std::string text = "no pose yet";
  std::int64_t since_utime = 0;  ///< [us] Time since which it holds.
};

/// Names for pages and scripts: waiting, ok, unsure, lost, silent.
const char* state_name(Verdict::State state);

/// Whether a pose contains the vehicle's place, even from odometry alone.
bool has_place(const model::SlamPose& pose);

/// Draws the path and gives the verdict on the pose.
class ShownPose {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownPose(Change& changes) : changes_(&changes), driven_(changes) {
    verdict_.changed(changes) = {};
  }

  /// Adds the next pose and its reception time [us].
  void take(const model::SlamPose& pose, std::int64_t wall_us);
  /// Updates the verdict on that pose from its numbers.
  void judge(const SceneNumbers& numbers);
  /// Rate of poses; none before two were received at different times.
  std::optional<double> rate_hz() const;
  /// Whether poses with this rate (none = unknown) have stopped. Then the verdict is silent since
  /// `utime`.
  bool falls_silent(std::int64_t wall_us, std::optional<double> rate_hz, model::Utime utime);
  /// Another map begins, in another frame.
  void start_map() { driven_.clear(); }
  /// Removes all poses.
  void clear();

  /// The newest pose.
  const Part<std::optional<model::SlamPose>>& pose() const { return pose_; }
  /// The verdict on it.
  const Part<Verdict>& verdict() const { return verdict_; }
  /// The path of poses as received.
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
