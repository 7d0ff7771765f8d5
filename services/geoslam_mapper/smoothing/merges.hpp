// Landmarks that were made one, and taking that back.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/model/archive.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Two landmarks, the first of which became the second.
using MergedPair = std::pair<model::LandmarkId, model::LandmarkId>;

/// Joins landmarks, and keeps for a while what each of them had been observed as: where later
/// observations tell two landmarks, they are separated again. What was handed over to another node
/// since, or added to, stays.
class Merges {
 public:
  /// Most merges that can be taken back.
  static constexpr std::size_t kMost = 2048;

  /// The one of two landmarks that stays: that of a given map, which has a prior; else the one with
  /// more observations.
  static MergedPair in_order(model::LandmarkId a, model::LandmarkId b, const LandmarkMap& map);

  /// Makes the first landmark of the pair the second, in graph and map; both are in the graph. The
  /// graph is not solved. `is_final`: that it is one thing does not rest on how near the two are.
  void merge(const MergedPair& pair, bool is_final, GlobalMap& map);
  /// The same where what was observed of the two contradicts that they are one point, but nothing
  /// else can be: a thing that looks elsewhere from another side. What the first one was observed
  /// as does not count.
  void absorb(const MergedPair& pair, GlobalMap& map);
  /// The same as merge() where the graph has done it: `observed` is what it handed over.
  void adopt(const MergedPair& pair, std::vector<HandedOver> observed, GlobalMap& map);
  /// Whether the two were one and were separated.
  bool were_separated(model::LandmarkId a, model::LandmarkId b) const;

  /// Separates the one of the touched landmarks whose observations from before and after a merge
  /// contradict each other most, if any do; returns the new landmark. The graph is not solved.
  /// Cost: the observations of those that were merged.
  std::optional<model::LandmarkId> take_back(std::span<const model::Association> touched,
                                             GlobalMap& map);

  /// What a node that is taken out of the graph observed is another one's now.
  void hand_over(NodeIndex node);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.merges_, self.separated_);
  }

 private:
  struct Merge {
    StoredLandmark old_one;  ///< As it was.
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
  std::vector<MergedPair> separated_;  ///< Ids now, smaller first.
};

}  // namespace understory::geoslam_mapper::smoothing
