// Loop closures and what became of them.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/model/submap.hpp"
#include "services/viewer/part.hpp"

namespace understory::viewer {

/// A loop closure and what became of it.
struct SceneClosure {
  model::LoopClosure closure;
  std::string status = "sent";
  std::string reason;
};

/// At most 20,000 of them: the one of the lowest number goes first.
class ShownClosures {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownClosures(Change& changes) : changes_(&changes) {}

  /// A closure, or one that is taken back.
  void take(const model::LoopClosure& closure);
  /// What became of one; of another than these it is passed over.
  void take(const model::LoopResult& result);
  /// There are none.
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
