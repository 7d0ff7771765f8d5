// Takes improbable landmarks out of use.
#pragma once

#include <cstdint>

#include "services/existence_tracker/parameters.hpp"
#include "services/existence_tracker/tracked_point.hpp"

namespace understory::existence_tracker {

/// Takes landmarks out of use and into use again, and counts them. `may_be_used`: false for a new
/// landmark while most new ones turn out to be false.
class UseOfLandmarks {
 public:
  /// Without landmarks.
  explicit UseOfLandmarks(const UseParameters& parameters = {}) : parameters_(parameters) {}

  /// Decides by the landmark's present probability.
  void decide(TrackedPoint& tracked, bool may_be_used);
  /// Undoes a removal from use if its looks in this pass turn out to have been occluded.
  void take_back(TrackedPoint& tracked, bool may_be_used);

  /// A landmark was added ...
  void add(const TrackedPoint& tracked) { unused_ += tracked.is_in_use ? 0 : 1; }
  /// ... or is erased.
  void erase(const TrackedPoint& tracked) { unused_ -= tracked.is_in_use ? 0 : 1; }
  /// Starts with other landmarks: call add() for each.
  void begin_anew() { unused_ = 0; }

  /// Number of landmarks out of use.
  std::uint32_t unused() const { return unused_; }
  /// Landmarks taken out of use so far.
  std::uint64_t dropped() const { return dropped_; }
  /// Landmarks taken into use again so far.
  std::uint64_t readmitted() const { return readmitted_; }

  /// Members of a saved state; see common/state. After a load call add() for each landmark.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.dropped_, self.readmitted_);
  }

 private:
  void readmit(TrackedPoint& tracked);

  UseParameters parameters_;
  std::uint32_t unused_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t readmitted_ = 0;
};

}  // namespace understory::existence_tracker
