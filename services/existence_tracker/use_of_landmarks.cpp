#include "services/existence_tracker/use_of_landmarks.hpp"

namespace understory::existence_tracker {

void UseOfLandmarks::decide(TrackedPoint& tracked, bool may_be_used) {
  const double probability = tracked.point.probability();
  const bool is_gone = probability < parameters_.drop_below;
  if (tracked.is_in_use && (is_gone || !may_be_used)) {
    tracked.is_in_use = false;
    tracked.has_just_left = true;
    ++unused_;
    ++dropped_;
  } else if (!tracked.is_in_use && probability > parameters_.readmit_above && may_be_used) {
    readmit(tracked);
  }
}

void UseOfLandmarks::take_back(TrackedPoint& tracked, bool may_be_used) {
  const bool is_probable = tracked.point.probability() >= parameters_.drop_below;
  if (!tracked.has_just_left || tracked.is_in_use || !is_probable || !may_be_used) return;
  tracked.has_just_left = false;
  readmit(tracked);
}

void UseOfLandmarks::readmit(TrackedPoint& tracked) {
  tracked.is_in_use = true;
  --unused_;
  ++readmitted_;
}

}  // namespace understory::existence_tracker
