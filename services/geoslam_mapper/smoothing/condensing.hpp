// The path behind the vehicle, condensed.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/cutting.hpp"
#include "services/geoslam_mapper/smoothing/discovery.hpp"
#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/known_ground.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"
#include "services/geoslam_mapper/smoothing/stretch.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Keeps the graph's cost to that of the ground around the vehicle: the nodes of each stretch of
/// the path become one, with one condensed measurement of each landmark (thesis on submaps §3.4.2),
/// once the vehicle is so far on that it does not see from there any more. All that is not
/// condensed yet stays exact. Where a stretch ends: see CutPolicy.
class Condensing {
 public:
  /// `parameters` gives `condense_*` and `cut_*`.
  explicit Condensing(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Nodes that are to become one with the next keyframe.
  struct Due {
    std::vector<NodeIndex> nodes;  ///< Empty: none.
    std::size_t waited = 0;        ///< How many of those that wait end with them.
    std::optional<Stretch> was;    ///< Their factors, where they are kept.
  };
  /// The oldest stretch, once it is complete and the vehicle, whose sensor sees so far [m], is far
  /// enough beyond it. Each elimination takes in the whole window around the vehicle, so fuse()
  /// condenses it with the keyframe's own. `known_ground`: what it has not judged yet waits.
  Due due(double range_m, const KnownGround& known_ground, const GlobalMap& map);
  /// To be called once a keyframe is done: what the next one's solution will take in, if anything,
  /// is computed with this one, which takes less time.
  void compute_ahead(double range_m, const KnownGround& known_ground, GlobalMap& map);
  /// To be called after each accepted keyframe: hands over what the nodes of the stretch had. One
  /// that could not be condensed stays as it is. Cost: what its nodes observed.
  void follow(const FusedKeyframe& fused, Due due, Discovery& discovery, Merges& merges,
              GlobalMap& map);

  /// From now on the factors of each stretch are kept for take_stretches(); who asks for them must
  /// take them, or they grow with the drive. Ask before the first keyframe: of a stretch that was
  /// condensed before, they are gone.
  void keep_stretches() { keeps_stretches_ = true; }
  /// Whether they are kept.
  bool keeps_stretches() const { return keeps_stretches_; }
  /// The factors of the stretches that were condensed since the last call.
  std::vector<Stretch> take_stretches() { return std::exchange(stretches_, {}); }
  /// The factors of all nodes that are not condensed, with the node that holds the map, frame
  /// `map`. Cost: what they observed.
  Stretch rest(const GlobalMap& map) const;

  /// Members of a saved state; see common/state. Stretches that were not taken are not among them.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.next_number_);
  }

 private:
  /// A node that is not condensed yet.
  struct Passed {
    NodeIndex node = 0;
    double along_m = 0.0;     ///< Path of the vehicle up to it.
    std::uint32_t scans = 0;  ///< Of its keyframe.
    StretchNumber number{};   ///< Which is not given to another node.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.node, s.along_m, s.scans, s.number);
    }
  };
  std::size_t complete(double range_m, const KnownGround& known_ground, const GlobalMap& map);
  std::vector<Passed> present(std::size_t count, const PoseGraph& graph) const;
  static bool is_there(const Passed& passed, const PoseGraph& graph);
  static bool are_tied(NodeIndex before, NodeIndex node, const PoseGraph& graph);
  std::vector<CutNode> cut_nodes(const CutPolicy& policy, double end_m,
                                 const PoseGraph& graph) const;
  static void adopt(std::span<const Retirement> retired, Discovery& discovery, Merges& merges,
                    GlobalMap& map);
  Stretch stretch_of(std::span<const Passed> passed, const GlobalMap& map) const;

  SmoothingMapperParameters parameters_;
  bool keeps_stretches_ = false;
  std::vector<Stretch> stretches_;  ///< Since they were taken.
  std::deque<Passed> waiting_;      ///< In order of time.
  StretchNumber next_number_{1};    ///< 0 is the node that holds the map.
};

}  // namespace understory::geoslam_mapper::smoothing
