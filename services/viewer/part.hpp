// A part of a scene and its latest change.
#pragma once

#include "services/viewer/landmark_table.hpp"

namespace understory::viewer {

/// A part of the scene and the number of its latest change; 0 = none yet.
template <class T>
struct Part {
  T value{};
  Change change = 0;

  /// The value, for a change now; `changes` is the scene's counter.
  T& changed(Change& changes) {
    change = ++changes;
    return value;
  }
};

}  // namespace understory::viewer
