// Makes stories from the books.
#pragma once

#include "common/story/landmark_book.hpp"
#include "common/story/pose_book.hpp"
#include "common/story/story.hpp"

namespace understory::story {

/// Selects the pose of a question.
struct PoseQuestion {
  /// Criterion of the choice.
  enum class Choice : std::uint8_t {
    kNearest,  ///< Nearest to `utime`.
    kLast,
    kWorst,    ///< Largest sigma of the position, among valid poses.
    kSlowest,  ///< Longest time from the sensor; none where times are unknown.
  };
  Choice choice = Choice::kNearest;
  model::Utime utime = 0;
};

/// The story of a landmark, and of the one into which it was merged; `start` is the origin of times
/// in texts. O(its events); O(all landmarks) for an unknown id.
Answer tell_landmark(const LandmarkBook& book, model::LandmarkId id, model::Utime start);

/// The story of a pose. O(stored messages), for `kSlowest` with a logarithm.
Answer tell_pose(const PoseBook& book, const PoseQuestion& question, model::Utime start);

/// The messages from the sensor to a pose, in order; with `ms` where known. O(stored messages).
std::vector<StoryStep> steps_to(const PoseBook& book, const PoseRecord& pose);

}  // namespace understory::story
