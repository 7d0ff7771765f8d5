// Closures sent to the mapper, and its results.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/submap.hpp"

namespace understory::loop_closer {

/// Two places of a closure, by the path of the vehicle [m].
struct ClosurePaths {
  double from_m = 0.0;
  double to_m = 0.0;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.from_m, s.to_m);
  }
};

/// Keeps the latest closures sent, the path length of the last accepted one, and the revoked ones.
class SentClosures {
 public:
  /// Most closures kept, of each kind.
  static constexpr std::size_t kMost = 4096;
  /// A revoked closure blocks others within this distance at both ends [m of path].
  static constexpr double kRevokedM = 50.0;

  /// A closure was sent.
  void add(std::uint64_t id, const ClosurePaths& paths);
  /// Whether the closure is one of ours that is kept; then its result is recorded.
  bool note(const model::LoopResult& result);
  /// Path length at the last accepted closure [m]; a large negative value if there is none.
  double accepted_at_m() const { return accepted_at_m_; }
  /// Whether a closure between approximately these places was revoked.
  bool was_revoked(const ClosurePaths& paths) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sent_, self.revoked_, self.accepted_at_m_);
  }

 private:
  struct Sent {
    std::uint64_t id = 0;
    ClosurePaths paths;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.paths);
    }
  };
  std::deque<Sent> sent_;
  std::deque<ClosurePaths> revoked_;
  double accepted_at_m_ = -1e9;
};

}  // namespace understory::loop_closer
