// One run: its scene on the page, and its stories for clicks.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <type_traits>

#include "common/story/story_book.hpp"
#include "services/viewer/scene.hpp"
#include "services/viewer/scene_channels.hpp"

namespace understory::viewer {

/// A scene and the book of stories beside it.
class Run {
 public:
  /// `limits`: of the stories.
  explicit Run(const story::Limits& limits = {})
      : limits_(limits), stories_(std::make_unique<story::StoryBook>(limits)) {}

  /// Adds a message of a channel of for_each_channel(), with that channel's `take`.
  template <class T, class Take>
  void take(const T& value, const Take& take, std::int64_t wall_us) {
    take(scene_, value, wall_us);
    if constexpr (std::is_same_v<T, lidar_scan_t>) {
      if (const auto scan = wire::from_wire(value)) stories_->take(*scan, false, wall_us);
    } else if constexpr (std::is_same_v<T, model::PointSweep>) {
      stories_->take(value, false, wall_us);
    } else if constexpr (!std::is_same_v<T, typename wire::WireOf<T>::type>) {
      // The stories use only some of the values of common/model.
      stories_->take(value, wall_us);
    }
  }

  /// The object `story` for a question of the protocol. Throws std::runtime_error with the reason
  /// if there is none.
  nlohmann::ordered_json answer(const nlohmann::json& question) const;
  /// Resets to the state before the first message.
  void reset();

  Scene& scene() { return scene_; }
  const Scene& scene() const { return scene_; }

 private:
  story::Limits limits_;
  Scene scene_;
  std::unique_ptr<story::StoryBook> stories_;
};

}  // namespace understory::viewer
