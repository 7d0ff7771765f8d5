// What is told about a landmark or a pose: a value without any form.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::story {

/// Something that happened.
struct StoryEvent {
  model::Utime utime = 0;
  std::string text;
};

/// A quantity over time.
struct StorySeries {
  std::string name;
  std::string unit;             ///< Empty where it has none.
  std::vector<model::Utime> t;  ///< As long as `v`, not descending unless the stamps were.
  std::vector<double> v;
};

/// One message on the way from the sensor to a pose.
struct StoryStep {
  std::string name;  ///< Its channel.
  std::string text;
  std::optional<double> ms;  ///< Spent there; none where it is not known, or beside the way.
};

/// The answer to a question, in parts; any of them may be empty.
struct Story {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< Name and value.
  std::vector<StoryEvent> events;                          ///< In order of time.
  std::vector<StorySeries> series;
  std::vector<Eigen::Vector2d> seen_from;  ///< Places of the vehicle [m], frame map.
  std::vector<StoryStep> steps;            ///< From the sensor on.
};

/// A story, or why there is none.
struct Answer {
  std::optional<Story> story;
  std::string error;  ///< One line; empty where there is a story.
};

}  // namespace understory::story
