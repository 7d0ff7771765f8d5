// The changes of a scene since a page's last frame, as a message.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "services/viewer/scene.hpp"

namespace understory::viewer {

/// State of one scene at a page.
struct SceneCursor {
  Change change = 0;  ///< All parts (except landmarks and paths) are up to this change.
  LandmarkCursor landmarks;
  TrackCursor driven;
  TrackCursor keyframes;
  TrackCursor truth;
};

/// Inputs of a frame.
struct FrameRequest {
  std::size_t run = 0;
  std::uint64_t sequence = 0;
  std::uint64_t skipped = 0;       ///< Pictures that this page missed.
  std::int64_t wall_us = 0;        ///< Reception time of its newest message.
  std::set<std::string> overlays;  ///< Requested by the page.
  std::size_t most_landmarks =
      20'000;  ///< A frame contains at most this number; the next one continues.
  std::size_t most_points = 40'000;  ///< The same for paths.
};

/// Whether the page lacks any change. O(1).
bool has_news(const Scene& scene, const SceneCursor& cursor);
/// Whether the page lacks a pose of the vehicle, a verdict, or the whole scene. O(1).
bool has_moved(const Scene& scene, const SceneCursor& cursor);

/// The frame, and in `cursor` the page's state after it. `extra` is merged into the header. Cost:
/// the changes.
std::shared_ptr<const std::string> make_frame(const Scene& scene, const FrameRequest& request,
                                              const nlohmann::ordered_json& extra,
                                              SceneCursor& cursor);

}  // namespace understory::viewer
