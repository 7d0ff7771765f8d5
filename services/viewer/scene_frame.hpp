// What of a scene a page lacks, as a message.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "services/viewer/scene.hpp"

namespace understory::viewer {

/// What a page has of one scene.
struct SceneCursor {
  Change change = 0;  ///< It has all parts (but landmarks and paths) as they were then.
  LandmarkCursor landmarks;
  TrackCursor driven;
  TrackCursor keyframes;
  TrackCursor truth;
};

/// How a frame is made.
struct FrameRequest {
  std::size_t run = 0;
  std::uint64_t sequence = 0;
  std::uint64_t skipped = 0;            ///< Pictures that this page missed.
  std::int64_t wall_us = 0;             ///< When the newest of it came.
  std::set<std::string> overlays;       ///< That the page asked for.
  std::size_t most_landmarks = 20'000;  ///< A frame has at most so many; the next one goes on.
  std::size_t most_points = 40'000;     ///< The same of paths.
};

/// Whether the page lacks anything. O(1).
bool has_news(const Scene& scene, const SceneCursor& cursor);
/// Whether the page lacks a pose of the vehicle, a verdict or everything. O(1).
bool has_moved(const Scene& scene, const SceneCursor& cursor);

/// The frame, and in `cursor` what the page has when it has taken it. `extra` is merged into the
/// header. Costs what changed.
std::shared_ptr<const std::string> make_frame(const Scene& scene, const FrameRequest& request,
                                              const nlohmann::ordered_json& extra,
                                              SceneCursor& cursor);

}  // namespace understory::viewer
