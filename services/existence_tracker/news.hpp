// Order in which landmarks and their states are published.
#pragma once

#include <set>
#include <vector>

#include "services/existence_tracker/lessons.hpp"
#include "services/existence_tracker/parameters.hpp"

namespace understory::existence_tracker {

/// Keeps the landmarks that changed since they were published: in EXISTENCE, and as states for a
/// store.
class News {
 public:
  /// Nothing to publish.
  explicit News(const OutputParameters& parameters = {}) : parameters_(parameters) {}

  /// The landmark may have changed since the last EXISTENCE.
  void touch(model::LandmarkId id) { touched_.push_back(id); }
  /// A new landmark: its state is due.
  void begin(model::LandmarkId id) { due_.push_back(id); }
  /// The landmark's state changed.
  void make_due(model::LandmarkId id, TrackedPoint& tracked);
  /// Starts with other landmarks; none of them has changed.
  void begin_anew();

  /// Changed landmarks, and some of the others: so a subscriber that missed a message receives all
  /// of them in the end.
  std::set<model::LandmarkId> take_ids(const PointsById& points);
  /// Landmarks whose state is due, in order; some may be erased.
  std::vector<model::LandmarkId> take_due();

  /// Members of a saved state; see common/state. Due states follow from their points' flags: call
  /// begin() for each after a load.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.repeated_);
  }

 private:
  OutputParameters parameters_;
  std::vector<model::LandmarkId> touched_;  ///< Since the last message.
  std::vector<model::LandmarkId> due_;      ///< Since the last take_due(); perhaps erased.
  model::LandmarkId repeated_ = 0;          ///< The last one that was repeated.
};

}  // namespace understory::existence_tracker
