// Loop closures that other processes found, or persons set.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/submap.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/understatement.hpp"
#include "services/geoslam_mapper/smoothing/witnesses.hpp"

namespace understory::geoslam_mapper::smoothing {

/// One end of a closure in the graph.
struct ClosureEnd {
  NodeIndex node = 0;
  geometry::SE2WithCovariance node_T_end;
};

/// Takes loop closures into the graph, and out again. One that is within what the graph knows of
/// its ends counts at once. One that is not is a witness against the graph: it waits until the
/// witnesses that agree with it are beyond doubt (witnesses.hpp), or a person says so. Then all of
/// them count, and where the rest of the graph does not allow them, the variances of the path
/// between their ends are raised by the ratio of what the witnesses show to what was stated, to
/// 1000 times those stated at most. A set that does not fit even then is taken back exactly and
/// goes on waiting. After each that counts, those that wait count, too, where the graph expects
/// them by now.
class Closures {
 public:
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
    a(self.waiting_, self.understated_);
  }

 private:
  /// A closure between two nodes that does not count yet.
  struct Waiting {
    std::uint64_t id = 0;
    NodeIndex a = 0;
    NodeIndex b = 0;
    geometry::SE2WithCovariance a_T_b;
    double log10_false_alarm = 0.0;
    /// Variances between its ends over those that the graph states, as this closure has it.
    double misstatement = 1.0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.a, s.b, s.a_T_b, s.log10_false_alarm, s.misstatement);
    }
  };
  std::vector<Waiting> agreeing_with(const Waiting& one, const GlobalMap& map) const;
  bool agree(const Waiting& one, const Waiting& other, const GlobalMap& map) const;
  static bool join(std::span<const Waiting> closures, GlobalMap& map);
  /// A part of the vehicle's path.
  struct Stretch {
    NodeIndex first = 0;
    NodeIndex last = 0;
    double from_m = 0.0;
    double to_m = 0.0;
  };
  static Stretch stretch_of(std::span<const Waiting> closures, const GlobalMap& map);
  static std::optional<double> median_ratio(std::span<const Waiting> closures,
                                            const GlobalMap& map);
  void take_expected(GlobalMap& map);
  Decision overrule(std::span<const Waiting> closures, GlobalMap& map);

  std::vector<Waiting> waiting_;  ///< In order of arrival.
  Understatement understated_;    ///< By the closures that overruled the graph.
};

}  // namespace understory::geoslam_mapper::smoothing
