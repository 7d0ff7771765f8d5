// Stories from the books.
#pragma once

#include "common/story/landmark_book.hpp"
#include "common/story/pose_book.hpp"
#include "common/story/story.hpp"

namespace understory::story {

/// Which pose a question is about.
struct PoseQuestion {
  /// How it is chosen.
  enum class Choice : std::uint8_t {
    kNearest,  ///< To `utime`.
    kLast,
    kWorst,    ///< Largest sigma of the position, among poses that mean something.
    kSlowest,  ///< Longest from the sensor; where times are not known there is none.
  };
  Choice choice = Choice::kNearest;
  model::Utime utime = 0;
};

/// What became of a landmark, and of the one that it was merged into; `start` is the origin of
/// times in words. O(its events); O(all landmarks) for an id that is not known.
Answer tell_landmark(const LandmarkBook& book, model::LandmarkId id, model::Utime start);

/// How a pose was made. O(messages held), `kSlowest` with a logarithm.
Answer tell_pose(const PoseBook& book, const PoseQuestion& question, model::Utime start);

/// The messages from the sensor to a pose, in order; `ms` where it is known. O(messages held).
std::vector<StoryStep> steps_to(const PoseBook& book, const PoseRecord& pose);

}  // namespace understory::story
