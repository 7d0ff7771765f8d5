// Loop closures and their results.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/model/submap.hpp"
#include "services/viewer/part.hpp"

namespace understory::viewer {

/// A loop closure and its result.
struct SceneClosure {
  model::LoopClosure closure;
  std::string status = "sent";
  std::string reason;
};

/// At most 20,000; beyond that the lowest number is dropped first.
class ShownClosures {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownClosures(Change& changes) : changes_(&changes) {}

  /// Adds a closure, or its revocation.
  void take(const model::LoopClosure& closure);
  /// Sets the result of a closure; ignored if the closure is unknown.
  void take(const model::LoopResult& result);
  /// Removes all.
  void clear();

  /// By number.
  const std::map<std::uint64_t, SceneClosure>& by_id() const { return closures_; }
  /// Number of the latest change.
  Change change() const { return change_; }

 private:
  Change* changes_;
  Change change_ = 0;
  std::map<std::uint64_t, SceneClosure> closures_;
};

}  // namespace understory::viewer
