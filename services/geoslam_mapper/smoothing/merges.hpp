// Merges of landmarks, and their undo.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/model/archive.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Two landmarks; the first was merged into the second.
using MergedPair = std::pair<model::LandmarkId, model::LandmarkId>;

/// Merges landmarks, and keeps the separate observations for a while: if later observations show
/// two landmarks, they are separated again. Observations that were since handed over to another
/// node, or averaged with others, stay merged.
class Merges {
 public:
  /// Most merges that can be undone.
  static constexpr std::size_t kMost = 2048;

  /// Order of a merge: the landmark that stays (second) is the one of a given map, which has a
  /// prior; else the one with more observations.
  static MergedPair in_order(model::LandmarkId a, model::LandmarkId b, const LandmarkMap& map);

  /// Merges the first landmark of the pair into the second, in graph and map; both are in the
  /// graph. The graph is not solved. `is_final`: the decision does not depend on their distance.
  void merge(const MergedPair& pair, bool is_final, GlobalMap& map);
  /// Likewise for two landmarks whose observations contradict one point although there can be only
  /// one object, such as one that looks different from another side. The observations of the first
  /// are ignored.
  void absorb(const MergedPair& pair, GlobalMap& map);
  /// Likewise after the graph has merged them: `observed` are the observations it handed over.
  void adopt(const MergedPair& pair, std::vector<HandedOver> observed, GlobalMap& map);
  /// Whether the two were merged once and separated.
  bool were_separated(model::LandmarkId a, model::LandmarkId b) const;

  /// Separates the touched landmark whose observations from before and after a merge contradict
  /// each other most, if any do; returns the new landmark. The graph is not solved. Cost: the
  /// observations of the merged landmarks.
  std::optional<model::LandmarkId> take_back(std::span<const model::Association> touched,
                                             GlobalMap& map);

  /// A node leaves the graph: its observations belong to another one now.
  void hand_over(NodeIndex node);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.merges_, self.separated_);
  }

 private:
  struct Merge {
    StoredLandmark old_one;  ///< Before the merge.
    model::LandmarkId into = 0;
    std::vector<HandedOver> observed;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.old_one, s.into, s.observed);
    }
  };
  void join(const MergedPair& pair, GlobalMap& map);
  static double contradiction(const Merge& merge, const GlobalMap& map);
  model::LandmarkId separate(const Merge& merge, GlobalMap& map);

  std::vector<Merge> merges_;          ///< In order of time.
  std::vector<MergedPair> separated_;  ///< Present ids, smaller first.
};

}  // namespace understory::geoslam_mapper::smoothing
