// The landmarks of the map and which of them changed.
#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/model/archive.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Number of a node of the pose graph, in order of time.
using NodeIndex = std::uint32_t;

/// What the mapper knows of a landmark beside its place in the graph.
struct StoredLandmark {
  model::LandmarkId id = 0;
  /// Frame `map`; follows the graph as soon as the landmark is in it.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  /// Of a landmark of a given map [m^2], frame `map`; zero for all others.
  Eigen::Matrix2d prior_covariance = Eigen::Matrix2d::Zero();
  double information = 0.0;             ///< Sum of 1 / variance over its observations [1/m^2].
  double radius_m = 0.0;                ///< Mean over its observations; 0 for corners.
  std::uint32_t observation_count = 0;  ///< Scans in which it was detected.
  std::uint32_t last_keyframe = 0;      ///< Number of accepted keyframes at its last observation.
  std::vector<NodeIndex> nodes;         ///< That observed it, each once, the last one at the end.
  /// Path of the vehicle [m] at the nodes that observed it, before these were condensed; the latest
  /// kMostViews.
  std::vector<float> views_m;
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  bool is_late = false;    ///< Its place in the index is older than its position.
  bool is_unused = false;  ///< Taken for gone: it has a place in the index of those alone.

  /// Variance [m^2] of the position relative to the keyframes that observed it.
  double local_variance() const { return 1.0 / information; }
  static constexpr std::size_t kMostViews = 64;
  /// Whether it is of the map that was given to begin with. It enters the graph with its prior when
  /// it is first seen, or looked at closely.
  bool is_given() const { return !prior_covariance.isZero(0.0); }
  bool is_given_unseen() const { return is_given() && last_keyframe == 0; }
  /// A node at this path observed it, now.
  void viewed_at(double along_m) {
    const auto view_m = static_cast<float>(along_m);
    if (!views_m.empty() && views_m.back() == view_m) return;
    if (views_m.size() == kMostViews) views_m.erase(views_m.begin());
    views_m.push_back(view_m);
  }
  /// A node observed it, now. O(nodes).
  void observed_from(NodeIndex node) {
    if (!nodes.empty() && nodes.back() == node) return;
    std::erase(nodes, node);
    nodes.push_back(node);
  }
  /// What a node observed is another one's now. O(nodes).
  void replace(NodeIndex node, NodeIndex by) {
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    if (found == nodes.end()) return;
    if (std::find(nodes.begin(), nodes.end(), by) == nodes.end()) {
      *found = by;
    } else {
      nodes.erase(found);
    }
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.id, s.position_m, s.prior_covariance, s.information, s.radius_m, s.observation_count,
      s.last_keyframe, s.nodes, s.views_m, s.kind, s.is_late, s.is_unused);
  }
};

/// Landmarks by id, with a dynamic index over their positions. Every change costs what it touches.
class LandmarkMap {
 public:
  /// Largest distance [m] between a landmark and its place in the index; see move().
  static constexpr double kStaleness_m = 0.25;

  /// No landmarks yet; new ones get ids of map `map_id`.
  explicit LandmarkMap(std::uint32_t map_id = 1)
      : next_id_((model::LandmarkId{map_id} << model::kLandmarkCounterBits) | 1U) {}

  /// Adds a landmark of a given map (GeoSLAM §4.3.1). One without id gets the next one; one without
  /// covariance gets `sigma_m` per axis.
  void add_given(const model::MapLandmark& given, double sigma_m);
  /// Adds a new landmark, whatever `id` it carries, and returns the id that it gets.
  model::LandmarkId insert(StoredLandmark landmark);
  /// Removes a landmark; its id is never used again.
  void remove(model::LandmarkId id);
  /// Takes a landmark out that is kept elsewhere from now on. Throws std::out_of_range where there
  /// is none.
  StoredLandmark put_away(model::LandmarkId id);
  /// Adds a landmark that was put away.
  void bring_back(StoredLandmark landmark);
  /// Takes all landmarks out, in order of id.
  std::vector<StoredLandmark> release();
  /// Moves a landmark (frame `map`). The index follows at once where it is off by kStaleness_m,
  /// otherwise with the next catch_up(); its triangles always with that.
  void move(model::LandmarkId id, const Eigen::Vector2d& position_m);

  /// The landmark of an id. Throws std::out_of_range where there is none.
  StoredLandmark& at(model::LandmarkId id) { return landmarks_.at(id); }
  const StoredLandmark& at(model::LandmarkId id) const { return landmarks_.at(id); }
  /// All landmarks by id, ascending.
  const std::map<model::LandmarkId, StoredLandmark>& all() const { return landmarks_; }
  /// Whether any landmark was given to begin with.
  bool has_given() const { return has_given_; }
  /// Whether there is no landmark.
  bool empty() const { return landmarks_.empty(); }

  /// Index over the landmarks in use; positions in it may be off by kStaleness_m.
  const constellation::ConstellationMap& index() const { return index_; }
  /// Index over those that are taken for gone: nothing is placed by them, but who sees one again
  /// names it.
  const constellation::ConstellationMap& unused_index() const { return unused_index_; }
  /// Whether the landmark is to be used. Passed over where there is no such landmark.
  void set_in_use(model::LandmarkId id, bool is_in_use);
  /// Brings the index to within a centimetre and its triangles up to date, before a search by
  /// descriptors. O(what moved).
  void catch_up();

  /// Number of the map: upper 16 bit of the ids that it gives.
  std::uint32_t map_id() const { return model::map_of(next_id_); }

  /// Those around the vehicle that may be any of several by where they are, ascending.
  void set_loose(std::vector<model::LandmarkId> ids) { loose_ = std::move(ids); }
  /// Whether the landmark is one of them. O(log n).
  bool is_loose(model::LandmarkId id) const {
    return std::binary_search(loose_.begin(), loose_.end(), id);
  }

  /// Ids of landmarks that are new or moved since the last call, ascending, without the removed.
  std::vector<model::LandmarkId> take_changed();
  /// Reports all landmarks as changed: after a load, when the graph was solved anew.
  void mark_all_changed();

  /// Members of a saved state; see common/state. `changed_` is not among them: after a load all
  /// landmarks are reported as changed.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    std::vector<Eigen::Vector2d> indexed_m = self.indexed_positions();
    a(self.landmarks_, self.late_, self.loose_, self.next_id_, indexed_m);
    if constexpr (Archive::kReads) self.rebuild_index(indexed_m);
  }

 private:
  void put(const StoredLandmark& landmark);
  void forget_gone_late();
  constellation::ConstellationMap& index_of(const StoredLandmark& landmark) {
    return landmark.is_unused ? unused_index_ : index_;
  }
  std::vector<Eigen::Vector2d> indexed_positions() const;
  void rebuild_index(const std::vector<Eigen::Vector2d>& indexed_m);

  std::map<model::LandmarkId, StoredLandmark> landmarks_;
  constellation::ConstellationMap index_;
  constellation::ConstellationMap unused_index_;
  std::vector<model::LandmarkId> late_;     ///< Those with is_late, and as many others at most.
  std::vector<model::LandmarkId> changed_;  ///< With repetitions.
  std::vector<model::LandmarkId> loose_;    ///< Ascending.
  model::LandmarkId next_id_;
  bool has_given_ = false;
};

}  // namespace understory::geoslam_mapper::smoothing
