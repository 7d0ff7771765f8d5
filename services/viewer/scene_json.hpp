// The parts of a scene as JSON (protocol.md).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "services/viewer/scene.hpp"

namespace understory::viewer {

/// The result of a keyframe, without its lists.
nlohmann::ordered_json matches_json(const model::MapUpdate& update);

/// Adds the parts that changed after `since` to a header: pose, verdict, truth, submaps, closures,
/// processes, numbers, log.
void add_parts(const Scene& scene, Change since, nlohmann::ordered_json& header);

}  // namespace understory::viewer
