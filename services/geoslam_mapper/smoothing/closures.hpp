// Loop closures from other processes or set by hand.
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

/// Adds loop closures to the graph and removes them. A closure within the graph's uncertainty of
/// its ends is accepted at once. Another one contradicts the graph: it waits until enough
/// consistent closures (witnesses.hpp) support it, or a person confirms it. Then all of them are
/// accepted. If the rest of the graph does not allow them, the variances of the path between their
/// ends are raised by the ratio of the observed to the stated error, at most to 1000 times those
/// stated. A set that does not fit even then is rolled back exactly and waits on. After each
/// acceptance, waiting closures that the graph now predicts are accepted, too.
class Closures {
 public:
  /// Most closures that wait; beyond that the oldest is dropped.
  static constexpr std::size_t kMostWaiting = 32;

  /// Result of one closure.
  struct Decision {
    model::LoopResult::Status status = model::LoopResult::Status::kRefused;
    std::string reason;
  };
  /// Adds a closure with its ends, possibly one that was received before. Solves the graph if it is
  /// accepted. Cost: joint covariances of its ends and of the waiting ones; if accepted, an update
  /// of the graph between its ends.
  Decision take(const model::LoopClosure& closure, const ClosureEnd& from, const ClosureEnd& to,
                GlobalMap& map);
  /// Removes a closure again.
  Decision revoke(std::uint64_t id, GlobalMap& map);
  /// Nodes became parts of other nodes: moves the ends of waiting closures to these.
  void hand_over(std::span<const Retirement> retired);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.understated_);
  }

 private:
  /// A closure between two nodes that is not accepted yet.
  struct Waiting {
    std::uint64_t id = 0;
    NodeIndex a = 0;
    NodeIndex b = 0;
    geometry::SE2WithCovariance a_T_b;
    double log10_false_alarm = 0.0;
    /// Ratio of the variances between its ends by this closure to those that the graph states.
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
