// The story of a landmark or a pose as a value, independent of its presentation.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::story {

/// An event.
struct StoryEvent {
  model::Utime utime = 0;
  std::string text;
};

/// A quantity over time.
struct StorySeries {
  std::string name;
  std::string unit;             ///< Empty = no unit.
  std::vector<model::Utime> t;  ///< Same size as `v`; ascending unless the stamps were not.
  std::vector<double> v;
};

/// One message on the way from the sensor to a pose.
struct StoryStep {
  std::string name;  ///< Its channel.
  std::string text;
  std::optional<double>
      ms;  ///< Time spent there; none where unknown, or for a message beside the way.
};

/// The answer to a question, in parts; any of them may be empty.
struct Story {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< Name and value.
  std::vector<StoryEvent> events;                          ///< In order of time.
  std::vector<StorySeries> series;
  std::vector<Eigen::Vector2d> seen_from;  ///< Positions of the vehicle [m], frame map.
  std::vector<StoryStep> steps;            ///< Steps from the sensor on.
};

/// A story, or the reason why there is none.
struct Answer {
  std::optional<Story> story;
  std::string error;  ///< One line; empty if there is a story.
};

}  // namespace understory::story
