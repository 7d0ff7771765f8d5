// Loop closures that other processes found, or persons set.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/submap.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// One end of a closure in the graph.
struct ClosureEnd {
  NodeIndex node = 0;
  geometry::SE2WithCovariance node_T_end;
};

/// Takes loop closures into the graph, and out again. One that is within what the graph knows of
/// its ends counts at once; one that is not waits until others agree with it (pairwise consistency,
/// Mangelson et al. 2018: the way round two closures and the graph between their ends must close),
/// or a person says so. What the graph contradicts once it counts is taken back exactly.
class Closures {
 public:
  /// So many closures that agree with each other count against what the graph knows.
  static constexpr std::size_t kAgree = 3;
  /// Closures that wait, at most: then the oldest is dropped.
  static constexpr std::size_t kMostWaiting = 32;

  /// What became of one.
  struct Decision {
    model::LoopResult::Status status = model::LoopResult::Status::kRefused;
    std::string reason;
  };
  /// Takes a closure with its ends, which may have been told before. Solves where it counts. Cost:
  /// joint covariances of its ends and of the waiting ones; where it counts, an update of all
  /// between them.
  Decision take(const model::LoopClosure& closure, const ClosureEnd& from, const ClosureEnd& to,
                GlobalMap& map);
  /// Takes a closure back.
  Decision revoke(std::uint64_t id, GlobalMap& map);
  /// Nodes are parts of others now: what waits follows them.
  void hand_over(std::span<const Retirement> retired);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_);
  }

 private:
  /// A closure between two nodes that does not count yet.
  struct Waiting {
    std::uint64_t id = 0;
    NodeIndex a = 0;
    NodeIndex b = 0;
    geometry::SE2WithCovariance a_T_b;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.a, s.b, s.a_T_b);
    }
  };
  std::vector<Waiting> agreeing_with(const Waiting& one, const GlobalMap& map) const;
  static bool agree(const Waiting& one, const Waiting& other, const GlobalMap& map);
  static bool join(std::span<const Waiting> closures, GlobalMap& map);

  std::vector<Waiting> waiting_;  ///< In order of arrival.
};

}  // namespace understory::geoslam_mapper::smoothing
