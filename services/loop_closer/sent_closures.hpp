// What was told to the mapper, and what it made of it.
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

/// Remembers the latest closures that were sent, where the last one counted, and what was revoked.
class SentClosures {
 public:
  /// Most that are remembered, of each kind.
  static constexpr std::size_t kMost = 4096;
  /// A closure that was revoked speaks against others so near at both ends [m of path].
  static constexpr double kRevokedM = 50.0;

  /// A closure was sent.
  void add(std::uint64_t id, const ClosurePaths& paths);
  /// Whether it is one of ours that is remembered; then what became of it is noted.
  bool note(const model::LoopResult& result);
  /// Path at which a closure was accepted last [m]; far back where none was.
  double accepted_at_m() const { return accepted_at_m_; }
  /// Whether somebody has revoked a closure between about these places.
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
