// A story as the JSON object `story` of services/viewer/protocol.md. Users link nlohmann-json.
#pragma once

#include <nlohmann/json.hpp>

#include "common/story/story.hpp"

namespace understory::story {

/// The JSON object; empty parts and an unknown `ms` are left out.
inline nlohmann::ordered_json story_json(const Story& story) {
  using Json = nlohmann::ordered_json;
  Json json{{"title", story.title}};
  for (const auto& [name, value] : story.facts) json["facts"].push_back(Json::array({name, value}));
  for (const StoryEvent& one : story.events)
    json["events"].push_back(Json::array({one.utime, one.text}));
  for (const StorySeries& one : story.series)
    json["series"].push_back({{"name", one.name}, {"unit", one.unit}, {"t", one.t}, {"v", one.v}});
  for (const Eigen::Vector2d& place : story.seen_from)
    json["seen_from"].push_back(Json::array({place.x(), place.y()}));
  for (const StoryStep& one : story.steps) {
    Json step{{"name", one.name}, {"text", one.text}};
    if (one.ms) step["ms"] = *one.ms;
    json["steps"].push_back(std::move(step));
  }
  return json;
}

}  // namespace understory::story
