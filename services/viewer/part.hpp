// A part of a scene and when it last changed.
#pragma once

#include "services/viewer/landmark_table.hpp"

namespace understory::viewer {

/// A part of the scene and the number of its latest change; 0 = there is none yet.
template <class T>
struct Part {
  T value{};
  Change change = 0;

  /// The value, to be changed now; `changes` is the scene's counter.
  T& changed(Change& changes) {
    change = ++changes;
    return value;
  }
};

}  // namespace understory::viewer
