// Which landmarks are told next, and whose states are.
#pragma once

#include <set>
#include <vector>

#include "services/existence_tracker/lessons.hpp"
#include "services/existence_tracker/parameters.hpp"

namespace understory::existence_tracker {

/// Remembers which landmarks changed since they were told: in EXISTENCE, and as
/// states for a store.
class News {
 public:
  /// Nothing to tell.
  explicit News(const OutputParameters& parameters = {}) : parameters_(parameters) {}

  /// The landmark may have changed since the last EXISTENCE.
  void touch(model::LandmarkId id) { touched_.push_back(id); }
  /// A landmark that is new here: its state is due.
  void begin(model::LandmarkId id) { due_.push_back(id); }
  /// The landmark's state changed.
  void make_due(model::LandmarkId id, TrackedPoint& tracked);
  /// Other landmarks from now on; none of them has changed.
  void begin_anew();

  /// What changed, and some of the others: a subscriber that missed a message
  /// has all of them in the end.
  std::set<model::LandmarkId> take_ids(const PointsById& points);
  /// Landmarks whose state is due, in order; some may be gone.
  std::vector<model::LandmarkId> take_due();

  /// Members of a saved state; see common/state. States are due by their
  /// points' flags: begin() each after a load.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.repeated_);
  }

 private:
  OutputParameters parameters_;
  std::vector<model::LandmarkId> touched_;  ///< Since the last message.
  std::vector<model::LandmarkId> due_;      ///< Since their states were taken; perhaps gone.
  model::LandmarkId repeated_ = 0;          ///< The last one that was told again.
};

}  // namespace understory::existence_tracker
