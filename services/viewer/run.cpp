#include "services/viewer/run.hpp"

#include <charconv>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/story/json.hpp"

namespace understory::viewer {
namespace {

/// Ids exceed the range of JSON's numbers: they are sent as text.
model::LandmarkId asked_id(const nlohmann::json& question) {
  const auto text = question.at("id").get<std::string>();
  model::LandmarkId id = 0;
  const char* const end = text.data() + text.size();
  if (std::from_chars(text.data(), end, id).ptr != end) throw std::runtime_error("no landmark id");
  return id;
}

story::Answer told(const story::StoryBook& stories, const nlohmann::json& question) {
  const auto what = question.at("ask").get<std::string>();
  if (what == "landmark") return stories.landmark(asked_id(question));
  if (what != "pose") throw std::runtime_error("there are stories of landmarks and poses only");
  return stories.pose({story::PoseQuestion::Choice::kNearest,
                       static_cast<model::Utime>(question.at("utime").get<double>())});
}

}  // namespace

nlohmann::ordered_json Run::answer(const nlohmann::json& question) const {
  const story::Answer answer = told(*stories_, question);
  if (!answer.story) throw std::runtime_error(answer.error);
  return story::story_json(*answer.story);
}

void Run::reset() {
  scene_.reset();
  stories_ = std::make_unique<story::StoryBook>(limits_);
}

}  // namespace understory::viewer
